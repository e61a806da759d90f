#include "tests/support/scenes/room_materials.h"

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

// Uniform in 0..1 from lattice coordinates (an integer hash after Jenkins).
double Hash(int64_t x, int64_t y, int64_t z, uint32_t seed) {
  uint32_t h = seed * 0x9E3779B9u;
  for (int64_t v : {x, y, z}) {
    h ^= static_cast<uint32_t>(v) * 0x85EBCA6Bu;
    h = (h << 13) | (h >> 19);
    h = h * 5u + 0xE6546B64u;
  }
  h ^= h >> 16;
  h *= 0x7FEB352Du;
  h ^= h >> 15;
  h *= 0x846CA68Bu;
  h ^= h >> 16;
  return h * (1.0 / 4294967296.0);
}

double Smooth(double t) { return t * t * (3.0 - 2.0 * t); }

double Mix(double a, double b, double t) { return a + (b - a) * t; }

// Trilinear value noise on the unit lattice, 0..1.
double ValueNoise(const Eigen::Vector3d& p, uint32_t seed) {
  const double fx = std::floor(p.x()), fy = std::floor(p.y()), fz = std::floor(p.z());
  const auto ix = static_cast<int64_t>(fx), iy = static_cast<int64_t>(fy),
             iz = static_cast<int64_t>(fz);
  const double tx = Smooth(p.x() - fx), ty = Smooth(p.y() - fy), tz = Smooth(p.z() - fz);
  double planes[2];
  for (int k = 0; k < 2; ++k) {
    const double low = Mix(Hash(ix, iy, iz + k, seed), Hash(ix + 1, iy, iz + k, seed), tx);
    const double high = Mix(Hash(ix, iy + 1, iz + k, seed), Hash(ix + 1, iy + 1, iz + k, seed), tx);
    planes[k] = Mix(low, high, ty);
  }
  return Mix(planes[0], planes[1], tz);
}

double Fraction(double v) { return v - std::floor(v); }

// 1 inside, 0 outside, with an edge as soft as the footprint.
double SoftStep(double edge, double v, double footprint) {
  return std::clamp(0.5 + (v - edge) / std::max(footprint, 1e-6), 0.0, 1.0);
}

// Share of the second colour, 0..1.
double PatternShare(const Material& m,
                    const Eigen::Vector2d& surface,
                    const Eigen::Vector3d& solid,
                    double footprint_m,
                    uint32_t seed) {
  const double u = surface.x() / m.size_m;
  const double v = surface.y() / m.size_m;
  const double footprint = footprint_m / m.size_m;
  switch (m.pattern) {
    case Pattern::kPlain:
      return 0.0;
    case Pattern::kChecker: {
      const int64_t cell =
          static_cast<int64_t>(std::floor(u)) + static_cast<int64_t>(std::floor(v));
      return (cell & 1) != 0 ? 1.0 : 0.0;
    }
    case Pattern::kBricks: {
      const double row = std::floor(v * 2.0);
      const double x = Fraction(u + 0.5 * Fraction(row * 0.5) * 2.0);
      const double y = Fraction(v * 2.0);
      const double joint = std::min({x, 1.0 - x, 0.5 * y, 0.5 * (1.0 - y)});
      return 1.0 - SoftStep(0.04, joint, footprint);
    }
    case Pattern::kStripes:
      return SoftStep(0.25, std::abs(Fraction(u) - 0.5), footprint);
    case Pattern::kDots: {
      const double du = Fraction(u) - 0.5, dv = Fraction(v) - 0.5;
      return 1.0 - SoftStep(0.3, std::hypot(du, dv), footprint);
    }
    case Pattern::kWood: {
      const double bend = 0.8 * FractalNoise(solid, 0.5, footprint_m, 3, seed + 11);
      const Eigen::Vector3d grain(surface.x() * 0.12, surface.y(), bend);
      return FractalNoise(grain, m.size_m, footprint_m, 4, seed + 12);
    }
    case Pattern::kMarble: {
      const double bend = FractalNoise(solid, 0.3, footprint_m, 4, seed + 13);
      return 0.5 + 0.5 * std::sin(6.2831853 * (u + v * 0.6 + 2.2 * bend));
    }
    case Pattern::kPatches: {
      const double value = FractalNoise(solid, m.size_m, footprint_m, 3, seed + 14);
      return SoftStep(0.5, value, 0.08);
    }
  }
  return 0.0;
}

}  // namespace

Eigen::Vector3d Srgb(double r, double g, double b) {
  const auto linear = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return {linear(r), linear(g), linear(b)};
}

double FractalNoise(
    const Eigen::Vector3d& p, double coarsest_m, double footprint_m, int octaves, uint32_t seed) {
  double sum = 0.0, weight_sum = 0.0, weight = 1.0, wavelength = coarsest_m;
  for (int i = 0; i < octaves; ++i, wavelength *= 0.5, weight *= 0.7) {
    // An octave fades out between two footprints and one, to avoid aliasing.
    const double keep = std::clamp(wavelength / std::max(footprint_m, 1e-9) - 1.0, 0.0, 1.0);
    weight_sum += weight;
    sum += weight * (keep > 0.0 ? Mix(0.5, ValueNoise(p / wavelength, seed + i), keep) : 0.5);
  }
  return sum / weight_sum;
}

Eigen::Vector3d Albedo(const Material& material,
                       const Eigen::Vector2d& surface,
                       const Eigen::Vector3d& solid,
                       double footprint_m,
                       uint32_t seed) {
  const double share = PatternShare(material, surface, solid, footprint_m, seed);
  const Eigen::Vector3d color = material.color + (material.second_color - material.color) * share;
  const double n = FractalNoise(solid, material.noise_m, footprint_m, 6, seed);
  // Contrast is stretched: averaged octaves cluster around one half.
  const double gain = 1.0 + material.noise * std::clamp(4.0 * (n - 0.5), -1.0, 1.0);
  return (color * gain).cwiseMax(0.0).cwiseMin(1.0);
}

}  // namespace color3d
