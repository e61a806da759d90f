#include "core/scene/lens.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

// Radius after distortion without the tangential part, which is comparatively small.
double DistortedRadius(const Distortion& distortion, double r) {
  const auto& k = distortion.k;
  if (distortion.model == Distortion::Model::kFisheye) {
    const double theta = std::atan(r);
    const double t2 = theta * theta;
    return theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  }
  const double r2 = r * r;
  const double numerator = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double denominator = 1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
  return r * numerator / denominator;
}

// Radius up to which distortion is one-to-one: beyond it the polynomial folds back and would show
// parts of the photo twice.
double OneToOneRadius(const Distortion& distortion) {
  constexpr double kStep = 1.0 / 256.0;
  constexpr double kMaxRadius = 12.0;  // 85 degrees off axis
  double previous = 0.0;
  for (double r = kStep; r <= kMaxRadius; r += kStep) {
    const double distorted = DistortedRadius(distortion, r);
    if (!(distorted > previous)) return r - kStep;
    previous = distorted;
  }
  return kMaxRadius;
}

// Returns true if the outline of the picture of `camera` lies inside the photo, with half a pixel
// of tolerance (filled by replicated border pixels).
bool OutlineIsInside(const Camera& camera,
                     const Camera& captured,
                     const Distortion& distortion,
                     double max_radius) {
  constexpr int kSamples = 64;  // per side
  constexpr double kSlackPx = 0.5;
  for (int i = 0; i <= kSamples; ++i) {
    const double t = static_cast<double>(i) / kSamples;
    const double w = camera.width;
    const double h = camera.height;
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(t * w, 0.0),
                                         Eigen::Vector2d(t * w, h),
                                         Eigen::Vector2d(0.0, t * h),
                                         Eigen::Vector2d(w, t * h)}) {
      const Eigen::Vector3d ray = camera.Ray(pixel.x(), pixel.y());
      if (ray.head<2>().norm() > max_radius) return false;
      const Eigen::Vector2d seen = ProjectCaptured(captured, distortion, ray);
      const double u = seen.x(), v = seen.y();
      if (!(u >= -kSlackPx && u <= w + kSlackPx && v >= -kSlackPx && v <= h + kSlackPx)) {
        return false;
      }
    }
  }
  return true;
}

Camera Zoomed(const Camera& camera, double factor) {
  Camera zoomed = camera;
  zoomed.fx *= factor;
  zoomed.fy *= factor;
  return zoomed;
}

}  // namespace

bool IsUndistorted(const Distortion& distortion) {
  if (distortion.model == Distortion::Model::kFisheye) return false;
  return distortion.model == Distortion::Model::kNone ||
         std::ranges::all_of(distortion.k, [](double k) { return k == 0.0; });
}

Eigen::Vector2d Distort(const Distortion& distortion, const Eigen::Vector2d& p) {
  if (distortion.model == Distortion::Model::kNone) return p;
  const double r2 = p.squaredNorm();
  if (distortion.model == Distortion::Model::kFisheye) {
    const double r = std::sqrt(r2);
    return r < 1e-12 ? p : Eigen::Vector2d(p * (DistortedRadius(distortion, r) / r));
  }
  const auto& k = distortion.k;
  const double radial =
      (1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  const double p1 = k[2];
  const double p2 = k[3];
  const double x = p.x();
  const double y = p.y();
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

Eigen::Vector2d ProjectCaptured(const Camera& captured,
                                const Distortion& distortion,
                                const Eigen::Vector3d& in_camera) {
  const Eigen::Vector2d d = Distort(distortion, in_camera.head<2>() / in_camera.z());
  return captured.Project(d.homogeneous());
}

Camera UndistortedCamera(const Camera& captured, const Distortion& distortion) {
  if (IsUndistorted(distortion)) return captured;
  constexpr double kMinFactor = 0.5;
  constexpr double kMaxFactor = 8.0;
  const double max_radius = OneToOneRadius(distortion);
  const auto fits = [&](double factor) {
    return OutlineIsInside(Zoomed(captured, factor), captured, distortion, max_radius);
  };
  double low = kMinFactor;
  if (fits(low)) return Zoomed(captured, low);
  double high = 1.0;
  while (!fits(high)) {
    low = high;
    high *= 1.25;
    if (high > kMaxFactor) {
      throw InvalidArgument(
          "the lens distortion (k1 {}, k2 {}) folds the picture over; calibrate the camera again",
          distortion.k[0],
          distortion.k[1]);
    }
  }
  while (high - low > 1e-4) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? high : low) = middle;
  }
  return Zoomed(captured, high);
}

}  // namespace color3d
