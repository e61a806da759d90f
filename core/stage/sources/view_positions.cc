#include "core/stage/sources/view_positions.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/median.h"
#include "core/scene/photo_masks.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

// Compresses far positions: |v| / sqrt(1 + |v|^2 / 9) is at most 3 radii.
Eigen::Vector3d Bounded(const Eigen::Vector3d& v) {
  return v / std::sqrt(1.0 + v.squaredNorm() / 9.0);
}

constexpr double kMaxDifference = 15.0;  // L units; photos of one surface are exposed differently
constexpr int kWindowRadius = 2;

// True if two pictures of the same size agree around a pixel, by the mean of |difference|.
bool Agree(const Image& x, const Image& y, int column, int row) {
  const int left = std::max(0, column - kWindowRadius), top = std::max(0, row - kWindowRadius);
  const int right = std::min(x.width - 1, column + kWindowRadius);
  const int bottom = std::min(x.height - 1, row + kWindowRadius);
  double sum = 0.0;
  for (int r = top; r <= bottom; ++r) {
    for (int c = left; c <= right; ++c) sum += std::abs(x.At(0, r, c) - y.At(0, r, c));
  }
  return sum <= kMaxDifference * (right - left + 1) * (bottom - top + 1);
}

}  // namespace

ViewPositions::ViewPositions(const Scene& scene, const StageContext& context) : scene_(scene) {
  if (!context.HasInput(artifact::kGeometry)) return;
  geometry_ = ParseGaussians(context.ReadInput(artifact::kGeometry));
  const auto count = static_cast<int64_t>(geometry_->size());
  if (count == 0) {
    geometry_.reset();
    return;
  }
  std::vector<double> values(count);
  for (int axis = 0; axis < 3; ++axis) {
    for (int64_t i = 0; i < count; ++i) values[i] = geometry_->position[3 * i + axis];
    center_[axis] = Median(values);
  }
  for (int64_t i = 0; i < count; ++i) {
    const Eigen::Vector3d x(
        geometry_->position[3 * i], geometry_->position[3 * i + 1], geometry_->position[3 * i + 2]);
    values[i] = (x - center_).norm();
  }
  radius_ = std::max(Median(values), 1e-9);
}

Image ViewPositions::Of(int view,
                        const Camera& camera,
                        const Image& luminance,
                        const Image* mask) const {
  if (!geometry_) return {};
  const Pose& pose = scene_.views[view].cam_from_world;
  ThreadPool one(1);
  const RenderedView rendered = RenderView(*geometry_, scene_.views[view], camera, one);
  Image position(camera.width, camera.height, 4);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double depth = rendered.median_depth.At(0, y, x);
      if (!(depth > 0.0) || !Agree(rendered.lab, luminance, x, y)) continue;
      const Eigen::Vector3d world = pose.WorldFromCamera(depth * camera.Ray(x + 0.5, y + 0.5));
      const Eigen::Vector3d v = Bounded((world - center_) / radius_);
      for (int c = 0; c < 3; ++c) position.At(c, y, x) = static_cast<float>(v[c]);
      position.At(3, y, x) = 1.0f;
    }
  }
  ClearMasked(mask, &position);
  return position;
}

}  // namespace color3d
