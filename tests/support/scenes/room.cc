#include "tests/support/scenes/room.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/random.h"

namespace color3d {
namespace {
using Eigen::Vector3d;

constexpr double kHalfWidth = 2.7, kHalfHeight = 1.5, kHalfDepth = 3.2;
const Vector3d kLampCenter(-0.8, -1.42, 0.1);
constexpr double kLampHalfSize = 0.35;

// Linear RGB from the sRGB values that one would pick by eye.
Vector3d Srgb(double r, double g, double b) {
  const auto linear = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return {linear(r), linear(g), linear(b)};
}

Material Make(Pattern pattern,
              const Vector3d& color,
              const Vector3d& second,
              double size_m,
              double noise,
              double noise_m) {
  return {pattern, color, second, size_m, noise, noise_m};
}

}  // namespace

Room::Room(uint64_t seed) : seed_(static_cast<uint32_t>(seed * 7919u + 17u)) {
  AddShell();
  AddPictures();
  AddFurniture(seed);
}

Vector3d Room::ToLocal(const Object& object, const Vector3d& v) {
  return {object.cos_yaw * v.x() - object.sin_yaw * v.z(),
          v.y(),
          object.sin_yaw * v.x() + object.cos_yaw * v.z()};
}

Vector3d Room::ToWorld(const Object& object, const Vector3d& v) {
  return {object.cos_yaw * v.x() + object.sin_yaw * v.z(),
          v.y(),
          -object.sin_yaw * v.x() + object.cos_yaw * v.z()};
}

Room::Object Room::MakeBox(const Vector3d& center,
                           const Vector3d& half,
                           double yaw_degrees,
                           const Material& material) const {
  Object box;
  box.center = center;
  box.half = half;
  box.squared_radius = half.squaredNorm();
  box.cos_yaw = std::cos(yaw_degrees * 3.14159265358979 / 180.0);
  box.sin_yaw = std::sin(yaw_degrees * 3.14159265358979 / 180.0);
  box.materials = {material};
  return box;
}

void Room::AddShell() {
  const Material left =
      Make(Pattern::kStripes, Srgb(0.86, 0.70, 0.30), Srgb(0.78, 0.55, 0.18), 0.32, 0.22, 0.30);
  const Material right =
      Make(Pattern::kBricks, Srgb(0.66, 0.27, 0.20), Srgb(0.75, 0.68, 0.60), 0.42, 0.45, 0.20);
  const Material ceiling =
      Make(Pattern::kPlain, Srgb(0.86, 0.84, 0.80), Srgb(0.86, 0.84, 0.80), 0.3, 0.12, 0.40);
  const Material floor =
      Make(Pattern::kChecker, Srgb(0.80, 0.72, 0.58), Srgb(0.42, 0.22, 0.14), 0.45, 0.35, 0.30);
  const Material front = ceiling;
  const Material back =
      Make(Pattern::kMarble, Srgb(0.25, 0.50, 0.55), Srgb(0.33, 0.60, 0.62), 0.8, 0.40, 0.12);
  Object shell = MakeBox(Vector3d::Zero(), {kHalfWidth, kHalfHeight, kHalfDepth}, 0.0, left);
  shell.shape = Object::Shape::kRoom;
  shell.materials = {left, right, ceiling, floor, front, back};
  objects_.push_back(std::move(shell));
}

void Room::AddPictures() {
  const Material frame =
      Make(Pattern::kWood, Srgb(0.20, 0.13, 0.08), Srgb(0.35, 0.22, 0.12), 0.05, 0.2, 0.1);
  struct Picture {
    Vector3d center;
    double half_width, half_height;
    Material canvas;
  };
  const double z = kHalfDepth;
  const Picture pictures[] = {
      {{-1.45, -0.45, z},
       0.55,
       0.40,
       Make(Pattern::kPatches, Srgb(0.16, 0.30, 0.62), Srgb(0.90, 0.80, 0.45), 0.30, 0.3, 0.10)},
      {{0.15, -0.55, z},
       0.42,
       0.52,
       Make(Pattern::kPatches, Srgb(0.55, 0.12, 0.35), Srgb(0.93, 0.70, 0.72), 0.22, 0.25, 0.06)},
      {{1.65, -0.40, z},
       0.48,
       0.36,
       Make(Pattern::kPatches, Srgb(0.13, 0.42, 0.20), Srgb(0.72, 0.85, 0.50), 0.16, 0.3, 0.08)},
  };
  for (const Picture& p : pictures) {
    objects_.push_back(
        MakeBox(p.center, {p.half_width + 0.06, p.half_height + 0.06, 0.05}, 0.0, frame));
    Object canvas = MakeBox(p.center, {p.half_width, p.half_height, 0.06}, 0.0, p.canvas);
    objects_.push_back(std::move(canvas));
  }
}

void Room::AddFurniture(uint64_t seed) {
  Random random(seed, 3);
  const auto jitter = [&random](double range) { return random.NextUniform(-range, range); };
  const double ground = kHalfHeight;
  const Material wood =
      Make(Pattern::kWood, Srgb(0.45, 0.28, 0.14), Srgb(0.72, 0.50, 0.28), 0.07, 0.2, 0.15);
  const Material rug =
      Make(Pattern::kDots, Srgb(0.15, 0.22, 0.48), Srgb(0.80, 0.78, 0.85), 0.22, 0.35, 0.05);
  const Material sofa =
      Make(Pattern::kPlain, Srgb(0.30, 0.45, 0.22), Srgb(0.30, 0.45, 0.22), 0.2, 0.55, 0.06);
  const Material crate =
      Make(Pattern::kStripes, Srgb(0.40, 0.18, 0.45), Srgb(0.80, 0.70, 0.85), 0.12, 0.25, 0.2);
  const Material orange =
      Make(Pattern::kDots, Srgb(0.90, 0.45, 0.08), Srgb(0.97, 0.72, 0.30), 0.11, 0.25, 0.15);
  const Material vase =
      Make(Pattern::kMarble, Srgb(0.10, 0.35, 0.70), Srgb(0.88, 0.92, 0.96), 0.35, 0.15, 0.1);
  const Material globe =
      Make(Pattern::kPatches, Srgb(0.15, 0.40, 0.60), Srgb(0.62, 0.58, 0.25), 0.20, 0.3, 0.1);

  objects_.push_back(MakeBox({0.0, ground - 0.01, 0.6}, {1.5, 0.01, 1.0}, 8.0 + jitter(4), rug));
  // Table: top and four legs.
  const Vector3d table(0.15 + jitter(0.05), ground - 0.75, 1.0);
  objects_.push_back(MakeBox(table, {0.75, 0.035, 0.45}, -12.0, wood));
  for (int leg = 0; leg < 4; ++leg) {
    const Vector3d offset((leg & 1) ? 0.66 : -0.66, 0.39, (leg & 2) ? 0.37 : -0.37);
    Object box = MakeBox(table, {0.04, 0.355, 0.04}, -12.0, wood);
    box.center += ToWorld(box, offset);
    objects_.push_back(std::move(box));
  }
  const auto ellipsoid = [&](const Vector3d& center, const Vector3d& radii, const Material& m) {
    Object o = MakeBox(center, radii, jitter(180.0), m);
    o.shape = Object::Shape::kEllipsoid;
    objects_.push_back(std::move(o));
  };
  const double top = table.y() - 0.035;
  ellipsoid({table.x() - 0.35, top - 0.20, 0.95}, {0.20, 0.20, 0.20}, orange);
  ellipsoid({table.x() + 0.12, top - 0.28, 1.12}, {0.14, 0.28, 0.14}, vase);
  // Books, one on the other.
  const Vector3d covers[] = {
      Srgb(0.70, 0.12, 0.12), Srgb(0.12, 0.45, 0.40), Srgb(0.85, 0.75, 0.25)};
  for (int i = 0; i < 3; ++i) {
    const Material cover =
        Make(Pattern::kStripes, covers[i], 0.35 * covers[i], 0.05 + 0.04 * i, 0.15 + 0.1 * i, 0.04);
    objects_.push_back(MakeBox({table.x() + 0.48, top - 0.035 - 0.07 * i, 0.85},
                               {0.15, 0.035, 0.11},
                               20.0 * i - 25.0 + jitter(8),
                               cover));
  }
  // Sofa against the left wall, crate and globe on the right.
  objects_.push_back(MakeBox({-2.05, ground - 0.25, 1.6}, {0.5, 0.25, 1.0}, 0.0, sofa));
  objects_.push_back(MakeBox({-2.50, ground - 0.55, 1.6}, {0.18, 0.55, 1.0}, 0.0, sofa));
  const double turn = 28.0 + jitter(10);
  objects_.push_back(MakeBox({1.85, ground - 0.35, 1.9}, {0.36, 0.35, 0.36}, turn, crate));
  ellipsoid({1.85, ground - 1.0, 1.9}, {0.30, 0.30, 0.30}, globe);
}

bool Room::Misses(const Object& object, const Vector3d& origin, const Vector3d& direction) {
  const Vector3d to = object.center - origin;
  const double along = to.dot(direction), squared = to.squaredNorm(), d2 = direction.squaredNorm();
  if (along < 0.0 && squared > object.squared_radius) return true;
  return squared * d2 - along * along > object.squared_radius * d2;
}

bool Room::Intersect(const Object& object,
                     const Vector3d& origin,
                     const Vector3d& direction,
                     Hit* hit) {
  constexpr double kNear = 1e-6;
  const Vector3d o = ToLocal(object, origin - object.center);
  const Vector3d d = ToLocal(object, direction);
  if (object.shape == Object::Shape::kEllipsoid) {
    const Vector3d p = o.cwiseQuotient(object.half), q = d.cwiseQuotient(object.half);
    const double a = q.squaredNorm(), b = p.dot(q), c = p.squaredNorm() - 1.0;
    const double discriminant = b * b - a * c;
    if (discriminant <= 0.0) return false;
    const double t = (-b - std::sqrt(discriminant)) / a;
    if (t <= kNear) return false;
    const Vector3d local = (o + t * d).cwiseQuotient(object.half.cwiseAbs2());
    *hit = {t, -1, ToWorld(object, local.normalized())};
    return true;
  }
  double t_in = -std::numeric_limits<double>::infinity();
  double t_out = std::numeric_limits<double>::infinity();
  int axis_in = 0, axis_out = 0;
  for (int k = 0; k < 3; ++k) {
    const double inverse = 1.0 / d[k];  // an infinity is right here
    double t0 = (-object.half[k] - o[k]) * inverse, t1 = (object.half[k] - o[k]) * inverse;
    if (t0 > t1) std::swap(t0, t1);
    if (t0 > t_in) t_in = t0, axis_in = k;
    if (t1 < t_out) t_out = t1, axis_out = k;
  }
  if (t_in > t_out) return false;
  const bool inside = object.shape == Object::Shape::kRoom;
  const double t = inside ? t_out : t_in;
  if (t <= kNear) return false;
  const int axis = inside ? axis_out : axis_in;
  Vector3d normal = Vector3d::Zero();
  normal[axis] = d[axis] > 0.0 ? -1.0 : 1.0;
  *hit = {t, -1, ToWorld(object, normal)};
  return true;
}

Hit Room::Trace(const Vector3d& origin, const Vector3d& direction) const {
  Hit best;
  best.distance = -1.0;
  Hit hit;
  for (size_t i = 0; i < objects_.size(); ++i) {
    if (i > 0 && Misses(objects_[i], origin, direction)) continue;
    if (!Intersect(objects_[i], origin, direction, &hit)) continue;
    if (best.object >= 0 && hit.distance >= best.distance) continue;
    best = hit;
    best.object = static_cast<int>(i);
  }
  return best;
}

bool Room::IsLit(const Vector3d& position, const Vector3d& lamp) const {
  const Vector3d to_lamp = lamp - position;
  Hit hit;
  for (size_t i = 1; i < objects_.size(); ++i) {
    if (Misses(objects_[i], position, to_lamp)) continue;
    if (Intersect(objects_[i], position, to_lamp, &hit) && hit.distance < 1.0) return false;
  }
  return true;
}

// Less light reaches the edges of the room.
double Room::CornerShade(const Vector3d& position) const {
  const Vector3d gaps = objects_[0].half - position.cwiseAbs();
  double shade = 1.0;
  for (int k = 0; k < 3; ++k) {
    shade *= 1.0 - 0.3 * std::exp(-std::max(gaps[k], 0.0) / 0.3);
  }
  return shade;
}

double Room::Clearance(const Object& object, const Vector3d& position) {
  const Vector3d p = ToLocal(object, position - object.center);
  if (object.shape == Object::Shape::kEllipsoid) {
    return (p.cwiseQuotient(object.half).norm() - 1.0) * object.half.minCoeff();
  }
  const Vector3d outside = p.cwiseAbs() - object.half;
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0);
}

// Less light reaches what stands close to something else (ambient occlusion in two steps).
double Room::ContactShade(const Hit& hit, const Vector3d& position) const {
  double shade = 1.0;
  for (const double reach : {0.07, 0.22}) {
    const Vector3d probe = position + reach * hit.normal;
    double clearance = reach;
    for (size_t i = 1; i < objects_.size(); ++i) {
      if (static_cast<int>(i) == hit.object) continue;
      const double bound = (probe - objects_[i].center).norm() - objects_[i].half.norm();
      if (bound < clearance) clearance = std::min(clearance, Clearance(objects_[i], probe));
    }
    shade -= 0.38 * (1.0 - std::max(clearance, 0.0) / reach);
  }
  return shade;
}

Vector3d Room::Radiance(const Hit& hit,
                        const Vector3d& position,
                        double footprint_m,
                        double lamp_u,
                        double lamp_v) const {
  const Object& object = objects_[hit.object];
  const Vector3d local = ToLocal(object, position - object.center);
  const Vector3d local_normal = ToLocal(object, hit.normal);
  int axis = 0;
  local_normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Vector2d surface;
  if (object.shape == Object::Shape::kEllipsoid) {
    const double longitude = std::atan2(local.z(), local.x());
    surface << longitude * object.half.x(),
        std::asin(std::clamp(local.y() / object.half.y(), -1.0, 1.0)) * object.half.y();
  } else {
    surface << local[axis == 0 ? 2 : 0], local[axis == 1 ? 2 : 1];
  }
  size_t material = 0;
  if (object.materials.size() == 6) material = 2 * axis + (local[axis] > 0.0 ? 1 : 0);
  const uint32_t noise_seed = seed_ + 101u * static_cast<uint32_t>(hit.object * 6 + material);
  const Vector3d albedo =
      Albedo(object.materials[material], surface, local, footprint_m, noise_seed);

  const Vector3d lamp =
      kLampCenter +
      Vector3d((2.0 * lamp_u - 1.0) * kLampHalfSize, 0.0, (2.0 * lamp_v - 1.0) * kLampHalfSize);
  const Vector3d start = position + 1e-4 * hit.normal;
  const Vector3d to_lamp = lamp - start;
  const double squared = to_lamp.squaredNorm();
  double direct =
      std::max(0.0, hit.normal.dot(to_lamp)) / std::sqrt(squared) / (1.0 + 0.12 * squared);
  if (direct > 0.0 && !IsLit(start, lamp)) direct = 0.0;
  const double facing = 0.85 - 0.15 * hit.normal.y();  // a little more from above
  const double ambient = facing * CornerShade(position) * ContactShade(hit, position);
  const double light = 0.42 * ambient + 1.05 * direct;
  return (albedo * light).cwiseMin(1.0);
}

}  // namespace color3d
