#include "tests/support/scenes/solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace color3d {
namespace {
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979;
constexpr double kNear = 1e-6;

}  // namespace

Solid::Solid(Shape its_shape,
             const Vector3d& its_center,
             const Vector3d& its_half,
             double yaw_degrees,
             const Material& material)
    : shape(its_shape),
      center(its_center),
      half(its_half),
      squared_radius(its_half.squaredNorm()),
      materials({material}) {
  SetYaw(yaw_degrees);
}

void Solid::SetYaw(double degrees) {
  cos_yaw = std::cos(degrees * kPi / 180.0);
  sin_yaw = std::sin(degrees * kPi / 180.0);
}

Vector3d Solid::ToLocal(const Vector3d& v) const {
  return {cos_yaw * v.x() - sin_yaw * v.z(), v.y(), sin_yaw * v.x() + cos_yaw * v.z()};
}

Vector3d Solid::ToWorld(const Vector3d& v) const {
  return {cos_yaw * v.x() + sin_yaw * v.z(), v.y(), -sin_yaw * v.x() + cos_yaw * v.z()};
}

double Solid::Height(double x) const { return half.z() * std::sin(2.0 * kPi * x / wave_m - phase); }

Vector3d Solid::OnMaterial(const Vector3d& world) const {
  Vector3d local = ToLocal(world - center);
  if (shape == Shape::kSheet) local.z() = 0.0;
  return local;
}

Vector3d Solid::InWorld(const Vector3d& on_material) const {
  Vector3d local = on_material;
  if (shape == Shape::kSheet) local.z() = Height(local.x());
  return center + ToWorld(local);
}

bool Solid::Misses(const Vector3d& origin, const Vector3d& direction) const {
  const Vector3d to = center - origin;
  const double along = to.dot(direction), squared = to.squaredNorm(), d2 = direction.squaredNorm();
  if (along < 0.0 && squared > squared_radius) return true;
  return squared * d2 - along * along > squared_radius * d2;
}

bool Solid::IntersectEllipsoid(const Vector3d& o, const Vector3d& d, Hit* hit) const {
  const Vector3d p = o.cwiseQuotient(half), q = d.cwiseQuotient(half);
  const double a = q.squaredNorm(), b = p.dot(q), c = p.squaredNorm() - 1.0;
  const double discriminant = b * b - a * c;
  if (discriminant <= 0.0) return false;
  const double t = (-b - std::sqrt(discriminant)) / a;
  if (t <= kNear) return false;
  const Vector3d local = (o + t * d).cwiseQuotient(half.cwiseAbs2());
  *hit = {t, -1, ToWorld(local.normalized())};
  return true;
}

// First crossing within the box around the sheet: steps much shorter than a wave, then bisection.
bool Solid::IntersectSheet(
    const Vector3d& o, const Vector3d& d, double t_in, double t_out, Hit* hit) const {
  constexpr int kSteps = 32, kHalvings = 45;
  const auto above = [&](double t) { return o.z() + t * d.z() - Height(o.x() + t * d.x()) > 0.0; };
  t_in = std::max(t_in, kNear);
  const bool side = above(t_in);
  double low = t_in, high = t_in;
  for (int i = 1; i <= kSteps && above(high) == side; ++i) {
    low = high;
    high = t_in + (t_out - t_in) * i / kSteps;
  }
  if (above(high) == side) return false;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (above(middle) == side ? low : high) = middle;
  }
  const double wave = 2.0 * kPi / wave_m;
  const double slope = half.z() * wave * std::cos(wave * (o.x() + low * d.x()) - phase);
  const Vector3d normal = ToWorld(Vector3d(-slope, 0.0, 1.0).normalized());
  *hit = {low, -1, side ? normal : -normal};
  return true;
}

bool Solid::Intersect(const Vector3d& origin, const Vector3d& direction, Hit* hit) const {
  const Vector3d o = ToLocal(origin - center);
  const Vector3d d = ToLocal(direction);
  if (shape == Shape::kEllipsoid) return IntersectEllipsoid(o, d, hit);
  double t_in = -std::numeric_limits<double>::infinity();
  double t_out = std::numeric_limits<double>::infinity();
  int axis_in = 0, axis_out = 0;
  for (int k = 0; k < 3; ++k) {
    const double inverse = 1.0 / d[k];  // may be infinite
    double t0 = (-half[k] - o[k]) * inverse, t1 = (half[k] - o[k]) * inverse;
    if (t0 > t1) std::swap(t0, t1);
    if (t0 > t_in) t_in = t0, axis_in = k;
    if (t1 < t_out) t_out = t1, axis_out = k;
  }
  if (t_in > t_out) return false;
  const bool inside = shape == Shape::kRoom;
  const double t = inside ? t_out : t_in;
  if (shape == Shape::kSheet) return t_out > kNear && IntersectSheet(o, d, t_in, t_out, hit);
  if (t <= kNear) return false;
  const int axis = inside ? axis_out : axis_in;
  Vector3d normal = Vector3d::Zero();
  normal[axis] = d[axis] > 0.0 ? -1.0 : 1.0;
  *hit = {t, -1, ToWorld(normal)};
  return true;
}

double Solid::Clearance(const Vector3d& position) const {
  const Vector3d p = ToLocal(position - center);
  if (shape == Shape::kEllipsoid) {
    return (p.cwiseQuotient(half).norm() - 1.0) * half.minCoeff();
  }
  const Vector3d outside = p.cwiseAbs() - half;
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0);
}

Vector3d Solid::AlbedoAt(const Vector3d& normal,
                         const Vector3d& position,
                         double footprint_m,
                         uint32_t seed) const {
  const Vector3d local = OnMaterial(position);
  int axis = 2;
  if (shape != Shape::kSheet) ToLocal(normal).cwiseAbs().maxCoeff(&axis);
  Eigen::Vector2d surface;
  if (shape == Shape::kEllipsoid) {
    const double longitude = std::atan2(local.z(), local.x());
    surface << longitude * half.x(),
        std::asin(std::clamp(local.y() / half.y(), -1.0, 1.0)) * half.y();
  } else {
    surface << local[axis == 0 ? 2 : 0], local[axis == 1 ? 2 : 1];
  }
  size_t material = 0;
  if (materials.size() == 6) material = 2 * axis + (local[axis] > 0.0 ? 1 : 0);
  return Albedo(materials[material],
                surface,
                local,
                footprint_m,
                seed + 101u * static_cast<uint32_t>(material));
}

}  // namespace color3d
