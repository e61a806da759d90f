// How well a COLMAP model's cameras explain its own observations: wrong intrinsics show here first.
// For this folder only.
#pragma once

#include <string>
#include <vector>

#include "core/scene/formats/colmap_model.h"

namespace color3d {

// Distances between where a camera's photos show sparse points and where the model projects them,
// px at the size that the camera was calibrated for.
struct CameraReprojection {
  uint32_t camera_id = 0;
  std::vector<std::string> photos;  // by name
  int64_t observations = 0;         // of existing points
  double mean_px = 0.0;
  double median_px = 0.0;
};

// One entry per camera that some image uses, by number. Observations that are not finite do not
// count.
std::vector<CameraReprojection> MeasureReprojection(const ColmapModel& model);

// A warning for each camera whose median is above 2 px, or above four times the other cameras'
// median and half a pixel.
std::vector<std::string> ReprojectionWarnings(const std::vector<CameraReprojection>& cameras);

}  // namespace color3d
