#include "tests/support/scenes/movers.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"

namespace color3d {
namespace {
using Eigen::Vector3d;
using Shape = Solid::Shape;

const std::pair<DynamicCase, const char*> kNames[] = {{DynamicCase::kTurning, "turning"},
                                                      {DynamicCase::kSliding, "sliding"},
                                                      {DynamicCase::kAppearing, "appearing"},
                                                      {DynamicCase::kFast, "fast"},
                                                      {DynamicCase::kOneStep, "one_step"},
                                                      {DynamicCase::kStill, "still"},
                                                      {DynamicCase::kDeforming, "deforming"}};

// Large patterns, since a mover is some twenty pixels wide.
Material Paint(Pattern pattern, const Vector3d& color, const Vector3d& second, double size_m) {
  return {pattern, color, second, size_m, 0.4, 0.25};
}

Solid Ball(const Vector3d& center, double yaw_degrees) {
  return Solid(Shape::kEllipsoid,
               center,
               {0.34, 0.34, 0.34},
               yaw_degrees,
               Paint(Pattern::kPatches, Srgb(0.93, 0.72, 0.20), Srgb(0.55, 0.10, 0.30), 0.30));
}

Solid Crate(const Vector3d& center, double yaw_degrees) {
  const Material side = Paint(Pattern::kDots, Srgb(0.12, 0.50, 0.55), Srgb(0.95, 0.55, 0.35), 0.26);
  const Material end =
      Paint(Pattern::kStripes, Srgb(0.85, 0.25, 0.20), Srgb(0.90, 0.85, 0.60), 0.24);
  const Material lid =
      Paint(Pattern::kPatches, Srgb(0.25, 0.55, 0.20), Srgb(0.80, 0.85, 0.35), 0.2);
  Solid crate(Shape::kBox, center, {0.34, 0.28, 0.30}, yaw_degrees, side);
  crate.materials = {end, end, lid, lid, side, side};
  return crate;
}

Solid Banner(const Vector3d& center, double phase) {
  Solid banner(Shape::kSheet,
               center,
               {0.60, 0.42, 0.12},
               10.0,
               Paint(Pattern::kPatches, Srgb(0.20, 0.28, 0.62), Srgb(0.90, 0.62, 0.30), 0.35));
  banner.wave_m = 0.8;
  banner.phase = phase;
  return banner;
}

Vector3d OnLine(double progress) { return {-0.65 + 1.3 * progress, 0.45, 0.45 - 0.3 * progress}; }

}  // namespace

const std::vector<DynamicCase>& DynamicCases() {
  static const std::vector<DynamicCase> cases = [] {
    std::vector<DynamicCase> all;
    for (const auto& [which, name] : kNames) all.push_back(which);
    return all;
  }();
  return cases;
}

std::string DynamicCaseName(DynamicCase which) {
  for (const auto& [each, name] : kNames) {
    if (each == which) return name;
  }
  throw InvalidArgument("there is no dynamic scene case {}", static_cast<int>(which));
}

DynamicCase DynamicCaseFromName(std::string_view name) {
  std::vector<std::string> known;
  for (const auto& [which, each] : kNames) {
    if (each == name) return which;
    known.emplace_back(each);
  }
  throw InvalidArgument(
      "there is no dynamic scene case \"{}\"; choose from {}", name, fmt::join(known, ", "));
}

bool IsMoving(DynamicCase which) {
  return which != DynamicCase::kOneStep && which != DynamicCase::kStill;
}

std::vector<std::optional<Solid>> MoversAt(DynamicCase which, int step, int times) {
  constexpr double kTurn = 165.0;  // degrees
  constexpr double kWaves = 2.0;
  const double progress = times > 1 ? static_cast<double>(step) / (times - 1) : 0.5;
  switch (which) {
    case DynamicCase::kTurning:
      return {Crate({0.55, 0.40, 0.25}, kTurn * progress),
              Ball({-0.45, 0.40, 0.35}, -kTurn * progress)};
    case DynamicCase::kSliding:
      return {Crate(OnLine(progress), 25.0)};
    case DynamicCase::kOneStep:
    case DynamicCase::kStill:
      return {Crate(OnLine(0.5), 25.0)};
    case DynamicCase::kAppearing: {
      std::optional<Solid> comes, goes;
      if (3 * step >= times) comes = Ball({-0.45, 0.40, 0.35}, 0.0);
      if (3 * step < 2 * times) goes = Crate({0.55, 0.40, 0.25}, 25.0);
      return {comes, goes};
    }
    case DynamicCase::kFast: {
      const int from_middle = step - times / 2;
      if (std::abs(from_middle) > 1) return {std::nullopt};
      return {Crate({0.05 + 1.1 * from_middle, 0.40, 0.25}, 25.0)};
    }
    case DynamicCase::kDeforming:
      return {Banner({0.05, 0.25, 0.30}, 6.28318530718 * kWaves * progress)};
  }
  return {};
}

Vector3d PaintedColor(const Solid& mover,
                      const Hit& hit,
                      const Vector3d& position,
                      double footprint_m,
                      uint32_t seed) {
  const Vector3d kFromLamp(-0.48, -0.80, -0.36);
  // The normal of a waving sheet changes at its points.
  const double facing =
      mover.shape == Shape::kSheet ? 0.5 : kFromLamp.dot(mover.ToLocal(hit.normal));
  return mover.AlbedoAt(hit.normal, position, footprint_m, seed) * (0.62 + 0.25 * facing);
}

}  // namespace color3d
