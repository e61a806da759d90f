// Reduction of training geometry to the available memory, by the estimate of
// core/catalogue/memory_model.h. Pure functions.
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

// Peak memory of training geometry at this size with this many Gaussians and the smallest caches,
// bytes.
int64_t GeometryBytes(const MemoryDemand& demand, int max_side_px, int max_gaussians);

// Keeps the requested values if they fit; else reduces caches first, then Gaussians down to a
// quarter, then the working size (not below 64 px) with them. Throws Error{kResourceExhausted} with
// the memory needed if even that does not fit, and with the photo's size if one photo alone is too
// large.
MemoryPlan PlanGeometryMemory(const MemoryDemand& demand, int64_t budget_bytes);

}  // namespace color3d
