// Where in space the surfaces lie that a view shows, for colours that are joined in space.
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
  // Without geometry among the inputs nothing is known.
  ViewPositions(const Scene& scene, const StageContext& context);

  // Whether the geometry says that nothing moves: frames of a place are photos of it.
  bool NothingMoves() const { return geometry_ && geometry_->motion.size() == 0; }

  // PictureFacts::position, of the size of `luminance`, the view's as `camera` takes it. Known
  // where the geometry is rendered as the view shows it: elsewhere, and where `mask` (of that size;
  // null: nowhere) is 0, the view shows something else. Empty without geometry.
  Image Of(int view, const Camera& camera, const Image& luminance, const Image* mask) const;

 private:
  const Scene& scene_;
  std::optional<GaussianModel> geometry_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double radius_ = 1.0;
};

}  // namespace color3d
