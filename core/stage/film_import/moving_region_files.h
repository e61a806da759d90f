// What of a film's frames moves on its own, as files. For this folder only.
#pragma once

#include <filesystem>
#include <vector>

#include "core/base/image.h"
#include "core/film/moving_regions.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Of each frame what moves, as a picture, and what stands still, as a mask of the frame's size.
class MovingRegionFiles {
 public:
  MovingRegionFiles(const Scene& scene, std::filesystem::path folder);  // the scene outlives it

  void Write(int view, const Image& moving) const;
  std::filesystem::path MovingFile(int view) const;
  // None where nothing stands still.
  std::filesystem::path StillFile(int view) const;
  // Of the scene's frames that `placed` has views of, by name: as kMovingRegions.
  void Leave(const Scene& placed, StageContext& context) const;

 private:
  const Scene& scene_;
  std::filesystem::path folder_;
};

// Looks for what moves in the frames `shot` of one camera, in their order, whose pictures lie below
// `frames_root`, and writes it. Throws Error{kCancelled}, and for frames that cannot be read.
ShotMotion WriteMovingRegions(const std::filesystem::path& frames_root,
                              const Scene& scene,
                              const std::vector<int>& shot,
                              const MovingRegionFiles& files,
                              StageContext& context);

}  // namespace color3d
