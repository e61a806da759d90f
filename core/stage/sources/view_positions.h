// Positions in space of the surfaces that a view shows, to relate colours in space.
#pragma once

#include <optional>

#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Thread-safe.
class ViewPositions {
 public:
  // Positions are unknown without geometry among the inputs.
  ViewPositions(const Scene& scene, const StageContext& context);

  // True if the geometry is static, so that frames are like photos.
  bool IsStatic() const { return geometry_ && !geometry_->IsDynamic(); }

  // Returns PictureFacts::position of the size of `luminance`, which is the view's as taken by
  // `camera`. Known where the rendered geometry agrees with `luminance` and `mask` (of the same
  // size; null: 1 everywhere) is not 0. Empty without geometry.
  Image Of(int view, const Camera& camera, const Image& luminance, const Image* mask) const;

 private:
  const Scene& scene_;
  std::optional<GaussianModel> geometry_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double radius_ = 1.0;
};

}  // namespace color3d
