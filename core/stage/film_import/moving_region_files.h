// Files with the moving regions of the frames of a film. For this folder only.
#pragma once

#include <filesystem>
#include <vector>

#include "core/base/image.h"
#include "core/film/moving_regions.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// For each frame a picture of the moving regions and a mask of the static background, which has the
// size of the frame.
class MovingRegionFiles {
 public:
  // The scene must outlive the object.
  MovingRegionFiles(const Scene& scene, std::filesystem::path folder);

  void Write(int view, const Image& moving) const;
  std::filesystem::path MovingFile(int view) const;
  // Empty if the frame has no static background.
  std::filesystem::path StillFile(int view) const;
  // Publishes kMovingRegions of the frames that `placed` has, by name.
  void Publish(const Scene& placed, StageContext& context) const;

 private:
  const Scene& scene_;
  std::filesystem::path folder_;
};

// Finds and writes the moving regions of the frames `shot` of one camera, in order. Their
// image_file is relative to `frames_root`. Throws Error{kCancelled}, and for unreadable frames.
ShotMotion WriteMovingRegions(const std::filesystem::path& frames_root,
                              const Scene& scene,
                              const std::vector<int>& shot,
                              const MovingRegionFiles& files,
                              StageContext& context);

}  // namespace color3d
