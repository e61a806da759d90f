// Memory estimate of training geometry, and its reduction to the available memory. Pure functions.
//
// Per Gaussian, in floats, with R = 11 + channels (degree + 1)^2 parameters: parameters and two
// Adam moments (3R), the last good state (3R), the gradient (R), one copy while densifying (R), a
// checkpoint being written (3R), and 32 for splats, sorting keys and statistics; that is 1008 bytes
// at degree 2 and 1316 at degree 3 in one channel. Each of its (Gaussian, tile) pairs takes 42
// bytes more: about 8 pairs a Gaussian, and not less than 400 pairs a tile. Measured on fern at
// degree 2 without checkpoints: 1.2 kB a Gaussian, pairs and all; whole peaks were 14 to 31 % below
// the estimate.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/scene/camera.h"

namespace color3d {

struct MemoryDemand {
  struct View {
    Camera captured;  // at full size: determines the memory of decoding
    Camera camera;    // undistorted, at full size: determines the working size
  };
  std::vector<View> views;        // views that are trained on or measured
  int max_side_px = 0;            // wanted working size
  int max_gaussians = 0;          // wanted cap
  int sh_degree = 0;              // of every channel, 0..3
  int channels = 1;               // that are trained; 3: also on chroma
  bool moves = false;             // the views are frames, possibly many: caches stay small
  int64_t deformation_bytes = 0;  // of a deformation field in training
};

struct MemoryPlan {
  int max_side_px = 0;
  int max_gaussians = 0;
  int64_t image_cache_bytes = 0;   // for ViewImages
  int64_t target_cache_bytes = 0;  // for GeometryProblem::picture_cache_bytes
  int64_t estimated_bytes = 0;     // peak, of all of it
  int64_t budget_bytes = 0;
  std::string note;  // the reductions and their reason; empty if none
};

int64_t BytesPerGaussian(int sh_degree, int channels = 1);

// Peak memory of training geometry at this size with this many Gaussians and the smallest caches,
// bytes.
int64_t GeometryBytes(const MemoryDemand& demand, int max_side_px, int max_gaussians);

// Keeps the requested values if they fit; else reduces caches first, then Gaussians down to a
// quarter, then the working size (not below 64 px) with them. Throws Error{kResourceExhausted} with
// the memory needed if even that does not fit, and with the photo's size if one photo alone is too
// large.
MemoryPlan PlanGeometryMemory(const MemoryDemand& demand, int64_t budget_bytes);

}  // namespace color3d
