// The moving Gaussians of a model at successive times, in the file's frame and quantized to bytes.
// Internal to the export. Not thread-safe.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"
#include "core/splat/motion/geometry_in_time.h"

namespace color3d {

class MoverFrames {
 public:
  // `pool` must outlive the object.
  MoverFrames(const GaussianModel& model, const ExportFrame& frame, ThreadPool& pool);

  // Moves to a time of the scene in seconds. Throws Error{kInvalidArgument} for values that are not
  // finite.
  void GoTo(double time_s);

  std::vector<float> position;   // 3
  std::vector<float> rotation;   // 4: -128..127, of the sign closer to the previous time
  std::vector<float> opacity;    // 1: 0..255
  std::vector<float> log_scale;  // 3
  std::vector<char> seen;        // opacity > 0
  std::vector<char> always;      // all ones

 private:
  void AddRotation(const float* unit, const float* before);

  GeometryInTime in_time_;
  ParameterBlock block_;
  RgbHarmonics colors_;
  ExportFrame frame_;
  ThreadPool& pool_;
};

}  // namespace color3d
