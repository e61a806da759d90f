// Dense depth of a posed view from its neighbours: plane sweep (Collins 1996) on census costs
// (Zabih & Woodfill 1994) with semi-global aggregation (Hirschmueller 2008). Luminance only, so it
// works on monochrome photos and bears changes of exposure. Pure functions, thread-safe.
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
  const Image* mask = nullptr;       // 1 channel of 0 and 1; what is 0 is not matched; null: all is
};

inline constexpr int kMaxSweepSources = 16;

struct PlaneSweepOptions {
  int planes = 96;  // evenly spaced in inverse depth, 8..512
  // Penalties of semi-global matching for a change by one plane and by more, bits of the census;
  // the latter is divided by 1 + |dL| / edge_contrast at edges of L.
  double small_step = 1.5;
  double large_step = 16.0;
  double edge_contrast = 8.0;
  void Validate() const;
  bool operator==(const PlaneSweepOptions&) const = default;
};

struct DepthMap {
  Image depth;       // 1 channel, camera depth in scene units; where masked out, as beside it
  Image confidence;  // 1 channel, 0..1: how clearly the best plane beats all others
};

// `nearest` and `farthest`: > 0, camera depth. `sources`: 1..kMaxSweepSources. Throws
// Error{kInvalidArgument} for an empty range or no source, Error{kCancelled}.
DepthMap SweepPlanes(const PosedLuminance& reference,
                     const std::vector<PosedLuminance>& sources,
                     double nearest,
                     double farthest,
                     const PlaneSweepOptions& options,
                     const CancellationToken& cancel);

}  // namespace color3d
