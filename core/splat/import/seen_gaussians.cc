#include "core/splat/import/seen_gaussians.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/evenly.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/raster/raster_camera.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {
namespace {

constexpr int kSmallSidePx = 96;       // of the depth pictures for occlusion
constexpr size_t kMaxSample = 50'000;  // Gaussians tested for visibility
constexpr float kLeastLogit = -1.5f;   // fainter ones do not count
constexpr double kDepthTolerance = 0.04;
constexpr double kNearShare = 0.15;  // of the focus
constexpr float kCoveredOpacity = 0.5f;

// Rendering depths needs no harmonics.
GaussianModel WithoutHarmonics(const GaussianModel& model) {
  GaussianModel plain;
  plain.position = model.position;
  plain.log_scale = model.log_scale;
  plain.rotation = model.rotation;
  plain.opacity_logit = model.opacity_logit;
  plain.sh_l.assign(model.size(), 0.0f);
  return plain;
}

}  // namespace

Ellipsoid EllipsoidOf(const GaussianModel& model, size_t i) {
  Ellipsoid e;
  const float* p = model.position.data() + 3 * i;
  e.center = {p[0], p[1], p[2]};
  const float* q = model.rotation.data() + 4 * i;
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  std::array<int, 3> order = {0, 1, 2};
  const float* s = model.log_scale.data() + 3 * i;
  std::sort(order.begin(), order.end(), [&](int a, int b) { return s[a] < s[b]; });
  for (int k = 0; k < 3; ++k) {
    e.axes.col(k) = turn.col(order[k]);
    e.radius[k] = std::exp(static_cast<double>(s[order[k]]));
  }
  e.opacity = 1.0 / (1.0 + std::exp(-static_cast<double>(model.opacity_logit[i])));
  return e;
}

std::vector<size_t> SpreadSample(const GaussianModel& model, size_t count) {
  std::vector<size_t> drawn;
  for (size_t i = 0; i < model.size(); ++i) {
    if (model.opacity_logit[i] > kLeastLogit) drawn.push_back(i);
  }
  return PickEvenly(std::move(drawn), count);
}

SeenGaussians::SeenGaussians(const GaussianModel& model, const Camera& picture, ThreadPool& pool)
    : parameters_(ParametersFromModel(WithoutHarmonics(model))),
      picture_(picture),
      small_(picture.FitWithin(kSmallSidePx)),
      pool_(pool) {
  for (const size_t i : SpreadSample(model, kMaxSample)) sample_.push_back(EllipsoidOf(model, i));
}

void SeenGaussians::Render(const Pose& cam_from_world) {
  constexpr float kBlack[3] = {0.0f, 0.0f, 0.0f};
  pipeline_.Forward({parameters_, ColorLayout{}.Spec(), MakeRasterCamera(small_, cam_from_world)},
                    kBlack,
                    /*depth_channel=*/true,
                    pool_);
}

bool SeenGaussians::Unhidden(const Eigen::Vector3d& in_camera) const {
  if (in_camera.z() <= kNearPlane) return false;
  const Eigen::Vector2d pixel = small_.Project(in_camera);
  if (!small_.Contains(pixel)) return false;
  const float surface =
      pipeline_.median_depth().Row(0, static_cast<int>(pixel.y()))[static_cast<int>(pixel.x())];
  return surface == 0.0f || in_camera.z() <= (1.0 + kDepthTolerance) * surface;
}

SeenGaussians::Measure SeenGaussians::At(const Pose& cam_from_world, double focus) {
  Render(cam_from_world);
  Measure measure;
  for (int y = 0; y < small_.height; ++y) {
    const float* transmittance = pipeline_.transmittance().Row(0, y);
    const float* depth = pipeline_.median_depth().Row(0, y);
    for (int x = 0; x < small_.width; ++x) {
      measure.covered += transmittance[x] < kCoveredOpacity ? 1.0 : 0.0;
      measure.near += depth[x] > 0.0f && depth[x] < kNearShare * focus ? 1.0 : 0.0;
    }
  }
  const double pixels = static_cast<double>(small_.width) * small_.height;
  measure.covered /= pixels;
  measure.near /= pixels;
  const Eigen::Vector3d eye = cam_from_world.Center();
  std::vector<double> sums(pool_.thread_count(), 0.0);
  pool_.ForRanges(static_cast<int64_t>(sample_.size()), [&](int64_t begin, int64_t end, int t) {
    for (int64_t i = begin; i < end; ++i) {
      const Ellipsoid& e = sample_[i];
      const Eigen::Vector3d in_camera = cam_from_world.Apply(e.center);
      if (!Unhidden(in_camera)) continue;
      // Area of the ellipsoid's projection along v relative to its largest one.
      const Eigen::Vector3d v = e.axes.transpose() * (e.center - eye).normalized();
      const double flat = e.radius[1] * e.radius[2];
      const Eigen::Vector3d faces(flat, e.radius[0] * e.radius[2], e.radius[0] * e.radius[1]);
      const double face = faces.cwiseProduct(v).norm() / flat;
      // Gaussians smaller than a pixel count less.
      const double side_px = picture_.fx * std::sqrt(flat) / in_camera.z();
      sums[t] += e.opacity * face * std::min(1.0, side_px);
    }
  });
  for (const double sum : sums) measure.seen += sum;
  return measure;
}

std::vector<char> SeenGaussians::Visible(const Pose& cam_from_world,
                                         const std::vector<Eigen::Vector3d>& points) {
  Render(cam_from_world);
  std::vector<char> visible(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    visible[i] = Unhidden(cam_from_world.Apply(points[i])) ? 1 : 0;
  }
  return visible;
}

}  // namespace color3d
