// Dense depth of a posed view from its neighbours: plane sweep (Collins 1996) on census costs
// (Zabih & Woodfill 1994) with semi-global aggregation (Hirschmueller 2008). Uses luminance alone,
// so it works on monochrome photos and under changes of exposure. Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/scene/camera.h"

namespace color3d {

struct PosedLuminance {
  Camera camera;  // of the picture
  Pose cam_from_world;
  const Image* luminance = nullptr;  // 1 channel, L 0..100
  const Image* mask = nullptr;       // 1 channel, 0 where not to be matched, else 1; null: all 1
};

inline constexpr int kMaxSweepSources = 16;

struct PlaneSweepOptions {
  int planes = 96;  // evenly spaced in inverse depth, 8..512
  // Penalties of semi-global matching for a change by one plane and by several, bits of the census.
  // The latter is divided by 1 + |dL| / edge_contrast.
  double small_step = 1.5;
  double large_step = 16.0;
  double edge_contrast = 8.0;
  void Validate() const;
  bool operator==(const PlaneSweepOptions&) const = default;
};

// Returns the camera depth of each pixel of `reference` (1 channel, scene units); masked pixels
// take that of their neighbours. `nearest` and `farthest`: > 0, camera depth. `sources`:
// 1..kMaxSweepSources. Throws Error{kInvalidArgument} for an empty range or no source,
// Error{kCancelled}.
Image SweepPlanes(const PosedLuminance& reference,
                  const std::vector<PosedLuminance>& sources,
                  double nearest,
                  double farthest,
                  const PlaneSweepOptions& options,
                  const CancellationToken& cancel);

}  // namespace color3d
