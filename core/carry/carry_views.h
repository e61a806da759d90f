// Carries colours from all key views into a view. Surfaces come from two depth maps, one rendered
// from the Gaussians and one swept from the photos; each pixel takes the more confident result.
// Thread-safe after construction.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/carry/carry.h"
#include "core/carry/plane_sweep.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

struct ViewSurfaces {
  SurfaceView rendered;              // depth of the Gaussians
  std::optional<SurfaceView> swept;  // by plane sweep; none when no other view overlaps
};

// Depth and opacity of the geometry at the view's time, 1 channel each.
struct RenderedSurface {
  Image depth;
  Image opacity;
};
// Called from several threads at once.
using SurfaceRenderer = std::function<RenderedSurface(int view, const Camera& camera)>;

class SurfaceMaker {
 public:
  // Surfaces have the size of `images`. Planes are swept at the size of `sweep_images` against at
  // most `depth_sources` training views, which have the view's time if views have times. The
  // references must outlive the object.
  SurfaceMaker(const Scene& scene,
               const ViewImages& images,
               const ViewImages& sweep_images,
               SurfaceRenderer render,
               int depth_sources,
               const PlaneSweepOptions& sweep,
               const CancellationToken& cancel);

  ViewSurfaces Make(int view) const;

 private:
  std::optional<SurfaceView> Sweep(int view, const SurfaceView& rendered) const;
  std::vector<int> TrainingViewsOfTime(int view) const;
  std::vector<Eigen::Vector3d> SurfacePoints(int view, const SurfaceView& rendered) const;

  const Scene& scene_;
  const ViewImages& images_;
  const ViewImages& sweep_images_;
  const SurfaceRenderer render_;
  const int depth_sources_;
  const PlaneSweepOptions sweep_;
  const CancellationToken& cancel_;
  const std::vector<int> training_;
  std::vector<std::vector<Eigen::Vector3d>> tracked_;  // points by view
};

struct ColoredKeyView {
  int view = 0;
  ViewSurfaces surfaces;
  CarriedColor color;
};

// Carries from all key views, whose colours have equally many channels; each gives only the colours
// that those before it do not give.
CarriedColor CarryFromAll(const std::vector<ColoredKeyView>& keys,
                          const ViewSurfaces& target,
                          const CarryOptions& options);

}  // namespace color3d
