#include "core/splat/model/hexplane_field.h"

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

constexpr int kMaxFeatures = 256;
constexpr int kMaxWidth = 1024;
constexpr int kMaxSpaceSamples = 1024;
constexpr int kMaxTimeSamples = 4096;
constexpr int kMultiple = 16;

bool IsMultipleUpTo(int value, int most) {
  return value >= kMultiple && value <= most && value % kMultiple == 0;
}

}  // namespace

const char* HexPlaneShape::Complaint() const {
  if (!(begin_s <= end_s) || !std::isfinite(begin_s) || !std::isfinite(end_s)) {
    return "its times are invalid";
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!(low[axis] < high[axis]) || !std::isfinite(high[axis] - low[axis])) {
      return "its box is empty or infinite";
    }
  }
  if (!(extent > 0.0f) || !std::isfinite(extent)) return "its extent is not positive";
  if (!IsMultipleUpTo(features, kMaxFeatures)) return "features must be a multiple of 16 up to 256";
  if (!IsMultipleUpTo(width, kMaxWidth)) return "its width must be a multiple of 16 up to 1024";
  if (levels.empty() || levels.size() > kMaxHexPlaneLevels) return "it must have 1 to 4 levels";
  for (const Level& level : levels) {
    if (level.space < 2 || level.space > kMaxSpaceSamples || level.time < 2 ||
        level.time > kMaxTimeSamples) {
      return "a plane must have 2 to 1024 samples along space and 2 to 4096 along time";
    }
  }
  return "";
}

size_t HexPlaneShape::PlaneFloats(int level, int plane) const {
  size_t floats = static_cast<size_t>(features);
  for (const int axis : kHexPlaneAxes[plane]) floats *= static_cast<size_t>(Samples(level, axis));
  return floats;
}

size_t HexPlaneShape::PlaneBegin(int level, int plane) const {
  size_t begin = 0;
  for (int l = 0; l <= level; ++l) {
    const int end = l < level ? kHexPlanes : plane;
    for (int p = 0; p < end; ++p) begin += PlaneFloats(l, p);
  }
  return begin;
}

size_t HexPlaneShape::WeightsBegin(int layer) const {
  return layer == 0 ? 0 : BiasBegin(layer - 1) + static_cast<size_t>(LayerOutputs(layer - 1));
}

size_t HexPlaneShape::BiasBegin(int layer) const {
  return WeightsBegin(layer) +
         static_cast<size_t>(LayerInputs(layer)) * static_cast<size_t>(LayerOutputs(layer));
}

float HexPlaneShape::UnitTime(double time_s) const {
  const double span = end_s - begin_s;
  if (!(span > 0.0)) return 0.0f;
  return static_cast<float>(std::clamp(2.0 * (time_s - begin_s) / span - 1.0, -1.0, 1.0));
}

}  // namespace color3d
