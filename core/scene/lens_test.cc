#include "core/scene/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

Distortion Brown(std::array<double, 8> k) { return {Distortion::Model::kBrown, k}; }
Distortion Fisheye(std::array<double, 8> k) { return {Distortion::Model::kFisheye, k}; }

const Camera kCamera{640, 480, 500.0, 510.0, 323.0, 236.0};

// OpenCV puts pixel centres at whole numbers, we at halves.
std::vector<Eigen::Vector2d> ProjectWithOpenCv(const Distortion& d,
                                               const std::vector<Eigen::Vector3d>& points) {
  const cv::Matx33d k(kCamera.fx, 0, kCamera.cx - 0.5, 0, kCamera.fy, kCamera.cy - 0.5, 0, 0, 1);
  std::vector<cv::Point3d> in;
  for (const auto& p : points) in.emplace_back(p.x(), p.y(), p.z());
  std::vector<cv::Point2d> out;
  const cv::Vec3d zero(0, 0, 0);
  if (d.model == Distortion::Model::kFisheye) {
    cv::fisheye::projectPoints(in, out, zero, zero, k, cv::Vec4d(d.k[0], d.k[1], d.k[2], d.k[3]));
  } else {
    cv::projectPoints(in, zero, zero, k, std::vector<double>(d.k.begin(), d.k.end()), out);
  }
  std::vector<Eigen::Vector2d> pixels;
  for (const auto& p : out) pixels.emplace_back(p.x + 0.5, p.y + 0.5);
  return pixels;
}

TEST(Lens, AgreesWithOpenCv) {
  Random random(1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 300; ++i) {
    points.emplace_back(
        random.NextUniform(-2, 2), random.NextUniform(-2, 2), random.NextUniform(2, 6));
  }
  for (const Distortion& d : {Brown({-0.2, 0.05, 0.003, -0.002, 0.01}),
                              Brown({-0.2, 0.05, 0.003, -0.002, 0.01, 0.02, -0.01, 0.004}),
                              Fisheye({0.05, -0.01, 0.003, -0.0005}),
                              Fisheye({})}) {
    const auto expected = ProjectWithOpenCv(d, points);
    for (size_t i = 0; i < points.size(); ++i) {
      EXPECT_LT((ProjectCaptured(kCamera, d, points[i]) - expected[i]).norm(), 1e-7);
    }
  }
}

TEST(Lens, UndistortedPictureHasNoEmptyBorders) {
  for (const Distortion& d : {Brown({-0.2, 0.05, 0.003, -0.002}),
                              Brown({0.15, 0.02}),
                              Brown({0.0, 0.0, 0.01, -0.01}),
                              Fisheye({0.03, -0.01}),
                              Fisheye({})}) {
    const Camera camera = UndistortedCamera(kCamera, d);
    EXPECT_EQ(camera.width, kCamera.width);
    EXPECT_NEAR(camera.fx / camera.fy, kCamera.fx / kCamera.fy, 1e-12);
    double closest = 1e9;
    for (int y = 0; y <= camera.height; y += 4) {
      for (int x = 0; x <= camera.width; x += 4) {
        const Eigen::Vector2d p = ProjectCaptured(kCamera, d, camera.Ray(x, y));
        const double inside = std::min(std::min(p.x(), kCamera.width - p.x()),
                                       std::min(p.y(), kCamera.height - p.y()));
        closest = std::min(closest, inside);
      }
    }
    EXPECT_GT(closest, -0.51);
    EXPECT_LT(closest, 0.0);  // it touches the border: no pixel is lost needlessly
  }
}

TEST(Lens, KeepsCameraWithoutDistortion) {
  for (const Distortion& d : {Distortion{}, Brown({})}) {
    EXPECT_TRUE(IsUndistorted(d));
    EXPECT_EQ(UndistortedCamera(kCamera, d).fx, kCamera.fx);
  }
  EXPECT_FALSE(IsUndistorted(Fisheye({})));
}

TEST(Lens, AvoidsOrRefusesFoldingDistortion) {
  // r (1 - r^2) turns back at r = 0.577, inside the picture: the field must end before.
  const Distortion fold = Brown({-1.0});
  const Camera camera = UndistortedCamera(kCamera, fold);
  const double corner = std::hypot(camera.cx / camera.fx, camera.cy / camera.fy);
  EXPECT_LT(corner, 0.58);
  EXPECT_THROW(UndistortedCamera(kCamera, Brown({-1e4})), Error);
}

}  // namespace
}  // namespace color3d
