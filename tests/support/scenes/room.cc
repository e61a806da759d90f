#include "tests/support/scenes/room.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {
using Eigen::Vector3d;

constexpr double kHalfWidth = 2.7, kHalfHeight = 1.5, kHalfDepth = 3.2;
const Vector3d kLampCenter(-0.8, -1.42, 0.1);
constexpr double kLampHalfSize = 0.35;

Material Make(Pattern pattern,
              const Vector3d& color,
              const Vector3d& second,
              double size_m,
              double noise,
              double noise_m) {
  return {pattern, color, second, size_m, noise, noise_m};
}

Solid Box(const Vector3d& center,
          const Vector3d& half,
          double yaw_degrees,
          const Material& material) {
  return Solid(Solid::Shape::kBox, center, half, yaw_degrees, material);
}

}  // namespace

Room::Room(uint64_t seed) : seed_(static_cast<uint32_t>(seed * 7919u + 17u)) {
  AddShell();
  AddPictures();
  AddFurniture(seed);
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
  Solid shell(
      Solid::Shape::kRoom, Vector3d::Zero(), {kHalfWidth, kHalfHeight, kHalfDepth}, 0.0, left);
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
        Box(p.center, {p.half_width + 0.06, p.half_height + 0.06, 0.05}, 0.0, frame));
    objects_.push_back(Box(p.center, {p.half_width, p.half_height, 0.06}, 0.0, p.canvas));
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

  objects_.push_back(Box({0.0, ground - 0.01, 0.6}, {1.5, 0.01, 1.0}, 8.0 + jitter(4), rug));
  // Table: top and four legs.
  const Vector3d table(0.15 + jitter(0.05), ground - 0.75, 1.0);
  objects_.push_back(Box(table, {0.75, 0.035, 0.45}, -12.0, wood));
  for (int leg = 0; leg < 4; ++leg) {
    const Vector3d offset((leg & 1) ? 0.66 : -0.66, 0.39, (leg & 2) ? 0.37 : -0.37);
    Solid box = Box(table, {0.04, 0.355, 0.04}, -12.0, wood);
    box.center += box.ToWorld(offset);
    objects_.push_back(std::move(box));
  }
  const auto ellipsoid = [&](const Vector3d& center, const Vector3d& radii, const Material& m) {
    objects_.emplace_back(Solid::Shape::kEllipsoid, center, radii, jitter(180.0), m);
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
    objects_.push_back(Box({table.x() + 0.48, top - 0.035 - 0.07 * i, 0.85},
                           {0.15, 0.035, 0.11},
                           20.0 * i - 25.0 + jitter(8),
                           cover));
  }
  // Sofa against the left wall, crate and globe on the right.
  objects_.push_back(Box({-2.05, ground - 0.25, 1.6}, {0.5, 0.25, 1.0}, 0.0, sofa));
  objects_.push_back(Box({-2.50, ground - 0.55, 1.6}, {0.18, 0.55, 1.0}, 0.0, sofa));
  const double turn = 28.0 + jitter(10);
  objects_.push_back(Box({1.85, ground - 0.35, 1.9}, {0.36, 0.35, 0.36}, turn, crate));
  ellipsoid({1.85, ground - 1.0, 1.9}, {0.30, 0.30, 0.30}, globe);
}

Hit Room::Trace(const Vector3d& origin, const Vector3d& direction) const {
  Hit best;
  best.distance = -1.0;
  Hit hit;
  for (size_t i = 0; i < objects_.size(); ++i) {
    if (i > 0 && objects_[i].Misses(origin, direction)) continue;
    if (!objects_[i].Intersect(origin, direction, &hit)) continue;
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
    if (objects_[i].Misses(position, to_lamp)) continue;
    if (objects_[i].Intersect(position, to_lamp, &hit) && hit.distance < 1.0) return false;
  }
  return true;
}

// Less light near the edges of the room.
double Room::CornerShade(const Vector3d& position) const {
  const Vector3d gaps = objects_[0].half - position.cwiseAbs();
  double shade = 1.0;
  for (int k = 0; k < 3; ++k) {
    shade *= 1.0 - 0.3 * std::exp(-std::max(gaps[k], 0.0) / 0.3);
  }
  return shade;
}

// Less light near other objects (ambient occlusion in two steps).
double Room::ContactShade(const Hit& hit, const Vector3d& position) const {
  double shade = 1.0;
  for (const double reach : {0.07, 0.22}) {
    const Vector3d probe = position + reach * hit.normal;
    double clearance = reach;
    for (size_t i = 1; i < objects_.size(); ++i) {
      if (static_cast<int>(i) == hit.object) continue;
      const double bound = (probe - objects_[i].center).norm() - objects_[i].half.norm();
      if (bound < clearance) clearance = std::min(clearance, objects_[i].Clearance(probe));
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
  // Solids have six faces at most: their noise differs.
  const uint32_t noise_seed = seed_ + 606u * static_cast<uint32_t>(hit.object);
  const Vector3d albedo =
      objects_[hit.object].AlbedoAt(hit.normal, position, footprint_m, noise_seed);

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
