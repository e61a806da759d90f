#include "core/view/path/camera_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/base/error.h"
#include "core/base/text/name_order.h"
#include "core/view/path/turn.h"
#include "core/view/scene_placement.h"

namespace color3d {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRamp = 0.12;       // share of a way on which its speed grows, and falls again
constexpr double kLeastGap = 1e-3;   // in curve parameters, for equal cameras
constexpr double kLeastWay = 1e-12;  // between two steps, so that the way always grows

double AngleBetween(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  return 2.0 * std::acos(std::clamp(std::abs(a.normalized().dot(b.normalized())), 0.0, 1.0));
}

}  // namespace

Camera CoverPicture(const Camera& camera, int width, int height) {
  const double scale = std::max(static_cast<double>(width) / camera.width,
                                static_cast<double>(height) / camera.height);
  return {width,
          height,
          scale * camera.fx,
          scale * camera.fy,
          0.5 * width + scale * (camera.cx - 0.5 * camera.width),
          0.5 * height + scale * (camera.cy - 0.5 * camera.height)};
}

SmoothPath::SmoothPath(const std::vector<PathCamera>& knots, double unit) {
  if (knots.empty() || !(unit > 0.0)) {
    throw InvalidArgument("a camera path needs a camera and a positive unit of length");
  }
  width_ = knots[0].camera.width;
  height_ = knots[0].camera.height;
  const auto between = [unit](const Numbers& a, const Numbers& b) {
    return (a.head<3>() - b.head<3>()).norm() / unit +
           AngleBetween(a.segment<4>(3), b.segment<4>(3)) + std::abs(a(7) - b(7));
  };
  knots_.resize(1);
  for (const PathCamera& knot : knots) {
    Numbers numbers;
    const Camera& camera = knot.camera;
    numbers << knot.cam_from_world.Center(),
        knot.cam_from_world.rotation.conjugate().normalized().coeffs(), std::log(camera.fx),
        std::log(camera.fy), camera.cx, camera.cy;
    // Takes the quaternion of the rotation that is closer to the previous one.
    if (knots_.size() > 1 && numbers.segment<4>(3).dot(knots_.back().segment<4>(3)) < 0.0) {
      numbers.segment<4>(3) *= -1.0;
    }
    knots_.push_back(numbers);
  }
  knots_[0] = knots_.size() > 2 ? Numbers(2.0 * knots_[1] - knots_[2]) : knots_[1];
  const Numbers last = knots_.back();
  knots_.push_back(knots.size() > 1 ? Numbers(2.0 * last - knots_[knots_.size() - 2]) : last);
  // Square roots of distances: the curve then has neither loops nor corners.
  for (size_t i = 0; i + 1 < knots_.size(); ++i) {
    gaps_.push_back(std::max(kLeastGap, std::sqrt(between(knots_[i], knots_[i + 1]))));
  }
  way_ = {0.0};
  Numbers before = Curve(0.0);
  for (size_t step = 1; step <= (knots.size() - 1) * kSteps; ++step) {
    const Numbers now = Curve(static_cast<double>(step) / kSteps);
    way_.push_back(way_.back() + std::max(kLeastWay, between(before, now)));
    before = now;
  }
  if (way_.back() > 0.0) length_ = way_.back();
}

// Barry and Goldman's pyramid of four knots.
SmoothPath::Numbers SmoothPath::Curve(double time) const {
  if (knots_.size() == 3) return knots_[1];
  const size_t segment = std::min(static_cast<size_t>(time), knots_.size() - 4);
  const Numbers* p = &knots_[segment];
  const double* gap = &gaps_[segment];
  const double t0 = -gap[0], t1 = 0.0, t2 = gap[1], t3 = gap[1] + gap[2];
  const double t = (time - static_cast<double>(segment)) * gap[1];
  const auto mix = [t](const Numbers& a, double from, const Numbers& b, double to) {
    return Numbers(((to - t) * a + (t - from) * b) / (to - from));
  };
  const Numbers a1 = mix(p[0], t0, p[1], t1), a2 = mix(p[1], t1, p[2], t2),
                a3 = mix(p[2], t2, p[3], t3);
  return mix(mix(a1, t0, a2, t2), t1, mix(a2, t1, a3, t3), t2);
}

PathCamera SmoothPath::CameraFrom(const Numbers& numbers) const {
  PathCamera result;
  result.camera = {
      width_, height_, std::exp(numbers(7)), std::exp(numbers(8)), numbers(9), numbers(10)};
  const Quaterniond world_from_camera(Eigen::Vector4d(numbers.segment<4>(3).normalized()));
  result.cam_from_world.rotation = world_from_camera.conjugate();
  result.cam_from_world.translation = -(world_from_camera.conjugate() * numbers.head<3>());
  return result;
}

PathCamera SmoothPath::At(double share) const {
  if (way_.size() < 2) return CameraFrom(knots_[1]);
  const double wanted = std::clamp(share, 0.0, 1.0) * length_;
  const auto after = std::upper_bound(way_.begin() + 1, way_.end() - 1, wanted);
  const size_t step = static_cast<size_t>(after - way_.begin()) - 1;
  const double part = (wanted - way_[step]) / (way_[step + 1] - way_[step]);
  return CameraFrom(Curve((static_cast<double>(step) + std::clamp(part, 0.0, 1.0)) / kSteps));
}

std::vector<double> FrameShares(int frames, bool bounce, bool closed) {
  std::vector<double> shares;
  for (int i = 0; i < frames; ++i) {
    if (bounce) {
      shares.push_back(0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * i / frames));
    } else if (closed) {
      shares.push_back(static_cast<double>(i) / frames);
    } else {
      // Distance for a speed that rises linearly, is constant and falls linearly.
      const double x = frames > 1 ? static_cast<double>(i) / (frames - 1) : 0.0;
      const double near = std::min(x, 1.0 - x);
      const double way =
          (near < kRamp ? near * near / (2.0 * kRamp) : near - kRamp / 2.0) / (1.0 - kRamp);
      shares.push_back(x < 0.5 ? way : 1.0 - way);
    }
  }
  return shares;
}

std::vector<PathCamera> TurnFrames(const Scene& scene,
                                   int key_view,
                                   const Vector3d& focus,
                                   const std::vector<double>& shares) {
  const ScenePlacement placement = PlaceScene(scene, key_view, focus);
  const Turn turn = TurnOf(scene, key_view, placement);
  Camera camera = scene.views.at(static_cast<size_t>(key_view)).camera;
  camera.cx = 0.5 * camera.width;
  camera.cy = 0.5 * camera.height;
  std::vector<PathCamera> frames;
  for (const double share : shares) {
    const Vector3d position = TurnPosition(turn, share);
    // Axes of the camera in the page's world: right, down, forward.
    const Vector3d forward = -position.normalized();
    Vector3d right = forward.cross(Vector3d::UnitY());
    if (right.norm() < 1e-6) {
      right = TurnPosition(turn, share + 1e-3) - position;  // from straight above
      right -= right.dot(forward) * forward;
      if (right.norm() < 1e-9) right = forward.unitOrthogonal();
    }
    right.normalize();
    Eigen::Matrix3d camera_from_page;
    camera_from_page << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    PathCamera frame{camera, {}};
    frame.cam_from_world.rotation =
        (Quaterniond(camera_from_page) * placement.rotation).normalized();
    const Vector3d center =
        placement.center + placement.rotation.conjugate() * position / placement.scale;
    frame.cam_from_world.translation = -(frame.cam_from_world.rotation * center);
    frames.push_back(frame);
  }
  return frames;
}

std::vector<int> ViewsInOrder(const Scene& scene) {
  std::vector<int> order(scene.views.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return ComesBefore(scene.views[static_cast<size_t>(a)].name,
                       scene.views[static_cast<size_t>(b)].name);
  });
  return order;
}

}  // namespace color3d
