// Reprojection errors of a COLMAP model by camera: they reveal wrong intrinsics. For this folder
// only.
#pragma once

#include <string>
#include <vector>

#include "core/scene/formats/colmap_model.h"

namespace color3d {

// Distances between observed and projected sparse points of one camera, px at the size that the
// camera was calibrated for.
struct CameraReprojection {
  uint32_t camera_id = 0;
  std::vector<std::string> photos;  // by name
  int64_t observations = 0;         // of existing points
  double mean_px = 0.0;
  double median_px = 0.0;
};

// Returns one entry for each camera that an image uses, by number. Observations that are not finite
// are ignored.
std::vector<CameraReprojection> MeasureReprojection(const ColmapModel& model);

// Returns a warning for each camera whose median error is above 2 px, or above both 0.5 px and four
// times the median of the other cameras.
std::vector<std::string> ReprojectionWarnings(const std::vector<CameraReprojection>& cameras);

}  // namespace color3d
