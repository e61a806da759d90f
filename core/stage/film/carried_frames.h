// Colours carried by optical flow along the cameras of a dynamic scene that took a key view.
#pragma once

#include <filesystem>
#include <vector>

#include "core/carry/carry_views.h"
#include "core/film/film_carry.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Keeps the frames in the scratch folder to bound memory. Thread-safe after construction.
class CarriedFrames {
 public:
  // `keys`: coloured key views. The references must outlive the object.
  CarriedFrames(const Scene& scene,
                const ViewImages& images,
                const std::vector<ColoredKeyView>& keys,
                const FilmCarryOptions& options,
                StageContext& context);

  // Frames that are nearest in time to `view`, one of each camera with a key view.
  std::vector<int> NearestTo(int view) const;
  // True if a camera with a key view took it.
  bool Has(int view) const { return has_[static_cast<size_t>(view)] != 0; }
  CarriedColor Of(int view) const;

 private:
  std::filesystem::path FileOf(int view) const;

  const Scene& scene_;
  const std::filesystem::path folder_;
  std::vector<char> has_;
};

}  // namespace color3d
