// Materials of the procedural room: two-colour patterns with fractal brightness, so that every
// material has a luminance texture at several scales and its colour can be learnt from grey. Pure
// functions.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace color3d {

enum class Pattern { kPlain, kChecker, kBricks, kStripes, kDots, kWood, kMarble, kPatches };

struct Material {
  Pattern pattern = Pattern::kPlain;
  Eigen::Vector3d color = Eigen::Vector3d::Zero();         // albedo, linear RGB in 0..1
  Eigen::Vector3d second_color = Eigen::Vector3d::Zero();  // of the pattern
  double size_m = 1.0;                                     // period of the pattern
  double noise = 0.0;                                      // relative brightness, 0..1
  double noise_m = 1.0;                                    // its coarsest wavelength
};

// Linear RGB from sRGB values in 0..1.
Eigen::Vector3d Srgb(double r, double g, double b);

// Value noise summed over `octaves` from `coarsest_m` down, 0..1 around one half. Detail finer than
// `footprint_m`, the size of a sample on the surface, is left out.
double FractalNoise(
    const Eigen::Vector3d& p, double coarsest_m, double footprint_m, int octaves, uint32_t seed);

// Albedo (linear RGB, 0..1) of a surface point: `surface` in the plane of the surface, m, for the
// pattern; `solid` in space, m, for the noise.
Eigen::Vector3d Albedo(const Material& material,
                       const Eigen::Vector2d& surface,
                       const Eigen::Vector3d& solid,
                       double footprint_m,
                       uint32_t seed);

}  // namespace color3d
