// Pictures to train on, in the kernels' form, kept in memory within a budget. Internal to the splat
// module. Not thread-safe.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include "core/splat/geometry_trainer.h"
#include "core/splat/plane_buffer.h"

namespace color3d {

// Planes with value = (sample + offset) * scale.
PlaneBuffer PlanesFromImage(const Image& image, float offset, float scale);

// Size at a level: 2^-level of the full size, at least 1 px.
int SizeAtLevel(int size_px, int level);

class TrainingTargets {
 public:
  // `luminance` must outlive this object.
  TrainingTargets(const LuminanceSource& luminance, int64_t budget_bytes)
      : luminance_(luminance), budget_bytes_(budget_bytes) {}

  // L' of a view at a level. Throws Error{kInvalidArgument} when the picture does not have the
  // camera's size.
  std::shared_ptr<const PlaneBuffer> Get(const PosedCamera& view, int level);

 private:
  const LuminanceSource& luminance_;
  int64_t budget_bytes_;
  int64_t used_bytes_ = 0;
  std::map<std::pair<int, int>, std::shared_ptr<const PlaneBuffer>> kept_;
};

}  // namespace color3d
