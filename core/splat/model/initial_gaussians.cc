#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/neighbors.h"

namespace color3d {
namespace {

constexpr int kNeighbors = 3;
constexpr double kInitialOpacity = 0.1;
constexpr double kMinSquaredDistance = 1e-7;  // as 3DGS: equal points still get a size
constexpr double kMaxCoordinate = 1e15;       // squares of distances stay in float32
constexpr double kLoneScale = 0.1;            // of a scene with one point

}  // namespace

GaussianModel InitialGaussians(const Scene& scene) {
  std::vector<NeighborTree::Point> points;
  for (const SparsePoint& point : scene.points) {
    if (!(point.position.cwiseAbs().maxCoeff() <= kMaxCoordinate)) {
      throw InvalidArgument(
          "sparse point {} is not finite or absurdly far away; rerun structure-from-motion",
          &point - scene.points.data());
    }
    points.push_back({static_cast<float>(point.position.x()),
                      static_cast<float>(point.position.y()),
                      static_cast<float>(point.position.z())});
  }
  if (points.empty()) {
    throw InvalidArgument(
        "the scene has no sparse points to start Gaussians from; give a scene with "
        "structure-from-motion points");
  }
  const NeighborTree tree(points);
  GaussianModel model;
  model.sh_l.assign(points.size(), 0.0f);
  const float logit = static_cast<float>(std::log(kInitialOpacity / (1.0 - kInitialOpacity)));
  model.opacity_logit.assign(points.size(), logit);
  std::vector<NeighborTree::Neighbor> near;
  for (const NeighborTree::Point& p : points) {
    tree.Find(p, kNeighbors + 1, near);  // the point itself is among them
    double sum = 0.0;
    for (size_t k = 1; k < near.size(); ++k) sum += near[k].squared_distance;
    const double mean =
        near.size() > 1 ? sum / static_cast<double>(near.size() - 1) : kLoneScale * kLoneScale;
    const float log_scale =
        static_cast<float>(0.5 * std::log(std::clamp(mean, kMinSquaredDistance, 1e12)));
    model.position.insert(model.position.end(), p.begin(), p.end());
    model.log_scale.insert(model.log_scale.end(), 3, log_scale);
    model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
  }
  return model;
}

}  // namespace color3d
