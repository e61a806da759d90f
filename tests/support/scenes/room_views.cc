#include "tests/support/scenes/room_views.h"

#include <algorithm>
#include <cmath>

#include "tests/support/scenes/look_at.h"

namespace color3d {
namespace {
using Eigen::Vector3d;

const Vector3d kTarget(0.0, 0.35, 1.3);
constexpr double kArcRadius = 3.3;
constexpr double kArcHalfAngle = 0.62;  // rad

float GammaEncode(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return static_cast<float>(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055);
}

}  // namespace

View ArcView(double t, int width, int height) {
  const double focal = 0.8 * std::max(width, height);
  View view;
  view.captured_camera = {width, height, focal, focal, 0.5 * width, 0.5 * height};
  view.camera = view.captured_camera;
  const double angle = kArcHalfAngle * t;
  const double radius = kArcRadius * (1.0 + 0.06 * std::sin(5.0 * t + 1.0));
  const Vector3d center(kTarget.x() + radius * std::sin(angle),
                        -0.25 + 0.28 * std::sin(4.0 * t),
                        kTarget.z() - radius * std::cos(angle));
  view.cam_from_world = LookAt(center, kTarget + Vector3d(0.25 * std::sin(7.0 * t), 0.0, 0.0));
  return view;
}

Vector3d RayDirection(const View& view, double x_px, double y_px) {
  return view.cam_from_world.rotation.conjugate() * view.camera.Ray(x_px, y_px);
}

std::optional<Eigen::Vector2d> PixelOf(const View& view, const Vector3d& point) {
  const Vector3d p = view.cam_from_world.Apply(point);
  if (p.z() <= 0.0) return std::nullopt;
  const Eigen::Vector2d pixel = view.camera.Project(p);
  if (!view.camera.Contains(pixel)) return std::nullopt;
  return pixel;
}

bool Sees(const Room& room, const View& view, const Vector3d& point) {
  const auto pixel = PixelOf(view, point);
  if (!pixel) return false;
  const double depth = view.cam_from_world.Apply(point).z();
  const Vector3d direction = RayDirection(view, pixel->x(), pixel->y());
  const Hit hit = room.Trace(view.cam_from_world.Center(), direction);
  return hit.object >= 0 && std::abs(hit.distance - depth) < 1e-4 * depth;
}

RoomSample SampleRoom(const Room& room, const View& view, int x, int y, const PixelSample& sample) {
  const Vector3d center = view.cam_from_world.Center();
  const Vector3d direction = RayDirection(view, x + sample.x(), y + sample.y());
  const Hit hit = room.Trace(center, direction);
  // Samples of the lamp in another order than those of the pixel, to decorrelate them.
  const PixelSample lamp{sample.index * (sample.side + 1) % (sample.side * sample.side),
                         sample.side};
  const Vector3d color = room.Radiance(hit,
                                       center + hit.distance * direction,
                                       sample.Footprint(view, direction, hit.distance),
                                       lamp.x(),
                                       lamp.y());
  return {color, hit.distance};
}

void SetPixel(const Vector3d& linear, int y, int x, Image* picture) {
  for (int c = 0; c < 3; ++c) picture->At(c, y, x) = GammaEncode(linear[c]);
}

}  // namespace color3d
