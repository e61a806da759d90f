#include "core/augment/elastic_noise.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace color3d {
namespace {

// The affine map changes no direction by more than half of its length, so that it is invertible.
constexpr double kMaxAffineShare = 0.49;

}  // namespace

ElasticNoise::ElasticNoise(int size_px,
                           int picture_px,
                           const ElasticOptions& options,
                           Random& random)
    : displacement_(size_px, size_px, 2) {
  for (int c = 0; c < 2; ++c) {
    cv::Mat plane(size_px, size_px, CV_32F, displacement_.Plane(c));
    for (size_t i = 0; i < displacement_.PlaneSize(); ++i) {
      displacement_.Plane(c)[i] = static_cast<float>(random.NextUniform(-1.0, 1.0));
    }
    cv::GaussianBlur(plane, plane, cv::Size(), options.sigma_px, 0.0, cv::BORDER_REFLECT);
    plane *= options.alpha_px;
  }
  // The corners (s, s), (s, -s) and (-s, -s) move by d0, d1 and d2: A = I + [d1 - d2, d0 - d1] /
  // 2s.
  const double s = std::max(1.0, picture_px / 3.0);
  const double most = std::min(options.affine_px, kMaxAffineShare * s);
  PlanePoint d[3];
  for (PlanePoint& point : d) {
    point.x = random.NextUniform(-most, most);
    point.y = random.NextUniform(-most, most);
  }
  xx_ = 1.0 + (d[1].x - d[2].x) / (2.0 * s);
  yx_ = (d[1].y - d[2].y) / (2.0 * s);
  xy_ = (d[0].x - d[1].x) / (2.0 * s);
  yy_ = 1.0 + (d[0].y - d[1].y) / (2.0 * s);
}

}  // namespace color3d
