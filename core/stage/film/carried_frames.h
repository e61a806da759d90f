// Colours carried by motion along the cameras of a dynamic scene that have a key view. For the
// stages of this layer only.
#pragma once

#include <filesystem>
#include <vector>

#include "core/carry/carry_views.h"
#include "core/film/film_carry.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Kept in the scratch folder, so that memory does not grow with the scene's length. Thread-safe
// after construction.
class FramesInColor {
 public:
  // `keys` as they are coloured. The references must outlive the object.
  FramesInColor(const Scene& scene,
                const ViewImages& images,
                const std::vector<ColoredKeyView>& keys,
                const FilmCarryOptions& options,
                StageContext& context);

  // Frames of the cameras with a key view that are nearest in time to `view`, one of each camera.
  std::vector<int> NearestTo(int view) const;
  // A camera with a key view took it.
  bool Has(int view) const { return has_[static_cast<size_t>(view)] != 0; }
  CarriedColor Of(int view) const;

 private:
  std::filesystem::path FileOf(int view) const;

  const Scene& scene_;
  const std::filesystem::path folder_;
  std::vector<char> has_;
};

}  // namespace color3d
