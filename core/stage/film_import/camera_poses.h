// Poses of several cameras that filmed one place with moving objects (DYNAMIC.md "Poses of films").
// For the import stage only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/import/import.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

// Frames of one camera, all of one shot.
struct FramesOfCamera {
  std::string film;        // for messages
  std::vector<int> views;  // of the scene, in order of time
};

struct PlacedCameras {
  ImportResult result;  // its views have the names, files and times of the frames
  FilmFindings findings;
};

// Estimates the poses of all cameras by structure-from-motion. `frames`: views of all cameras;
// `image_file` is relative to `frames_root`. A standing camera contributes the median of its
// frames, which all get the pose of that picture. Each frame of a moving camera gets a pose of its
// own from the static background. Cameras with poses for less than 80 % of their frames are left
// out with a warning. Publishes kMovingRegions of the frames with poses. The caller calls
// FinishPosedScene. Throws Error: kInvalidArgument with the remedy for fewer than two cameras with
// poses, and the errors of PlaceSequence.
PlacedCameras PlaceCameras(const std::filesystem::path& frames_root,
                           const Scene& frames,
                           const std::vector<FramesOfCamera>& cameras,
                           const ImportOptions& options,
                           StageContext& context);

}  // namespace color3d
