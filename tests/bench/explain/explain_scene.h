// What `color3d-bench explain` reads: a scene in true colours, its depth from a finished run, and
// the surfaces that pairs of views share. Plain values.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/metrics/consistency.h"

namespace color3d {

struct ExplainView {
  std::string name;
  Image lab;        // the true colours, undistorted
  Image luminance;  // of `lab`
  PosedDepth geometry;
  bool held_out = false;
};

struct ExplainPair {
  int first = 0;  // indices of views
  int second = 0;
  std::vector<PixelMatch> matches;  // every fourth pixel of every fourth row
  // What `first` shows, as seen from `second`, where they show one surface; elsewhere L of
  // `second`.
  Image warped;
};

struct ExplainScene {
  std::vector<ExplainView> views;
  int key = 0;  // index of the key view
  std::vector<ExplainPair> pairs;
};

// Reads the scene and the output folder of a `pipeline` run of it. Longer side of the pictures:
// side_px. Takes `most` >= 2 views, evenly spread, and the key view. Throws Error{kInvalidArgument}
// if the scene is not static, if `run` is not of this scene, if a photo is grey, or if fewer than
// two views show common surfaces.
ExplainScene ReadExplainScene(const std::filesystem::path& folder,
                              const std::filesystem::path& run,
                              int side_px,
                              int most,
                              ThreadPool& pool);

}  // namespace color3d
