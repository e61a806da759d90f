// Poses of several cameras that filmed one place, in part of which things move (DYNAMIC.md "Poses
// of films"). For the import stage only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/import/import.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

// One camera's frames, all of one shot.
struct FramesOfCamera {
  std::string film;        // for messages
  std::vector<int> views;  // of the scene, in order of time
};

struct PlacedCameras {
  ImportResult result;  // the scene's views have the frames' names, files and moments
  FilmFindings findings;
};

// `frames`: the views of all cameras, whose pictures lie at their image_file below `frames_root`.
// A camera that stands still gives one picture, the median over its time, to structure-from-motion,
// and all its frames that pose; of one that moves every frame finds its own by what stands still.
// Cameras of which less than 80 % of the frames find a place are left out, and named in a warning.
// Leaves kMovingRegions of the placed frames. What FinishPosedScene does is left to the caller.
// Throws Error: fewer than two cameras find a place, with what to do (kInvalidArgument); what
// PlaceSequence throws.
PlacedCameras PlaceCameras(const std::filesystem::path& frames_root,
                           const Scene& frames,
                           const std::vector<FramesOfCamera>& cameras,
                           const ImportOptions& options,
                           StageContext& context);

}  // namespace color3d
