// Lab-space Gaussians as structure-of-arrays float buffers (GAUSSIANS.md "Stage 2"). A plain value.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"
#include "core/splat/model/hexplane_field.h"

namespace color3d {

// Motion and lifetime of the last size() Gaussians of a model (DYNAMIC.md "Motion"). With t = -1
// at begin_s and 1 at end_s, and tau = t - center:
//   position + velocity tau + acceleration tau^2,  rotation + spin tau,
//   opacity exp(-(tau / exp(log_width))^2 / 2)
struct GaussianMotion {
  double begin_s = 0.0;
  double end_s = 0.0;               // >= begin_s
  std::vector<float> velocity;      // 3: world, per unit of t
  std::vector<float> acceleration;  // 3
  std::vector<float> spin;          // 4
  std::vector<float> center;        // 1
  std::vector<float> log_width;     // 1

  size_t size() const { return center.size(); }
  // Returns t of a time; 0 if begin_s equals end_s. Times outside are extrapolated.
  float UnitTime(double time_s) const;
};

// What three channels hold: L', a', b', or R, G, B for comparison with those (GAUSSIANS.md "Joint
// training").
enum class ColorSpace { kLab, kSrgb };

// Raw (pre-activation) parameters. Row i of an n-wide buffer is [i*n, (i+1)*n).
struct GaussianModel {
  ColorSpace color_space = ColorSpace::kLab;
  int channels = 1;          // 1: luminance only (warm-up); 3: L', a', b' or R, G, B
  int sh_degree = 0;         // of the first channel, 0..3
  int chroma_sh_degree = 0;  // of the others, 0..3

  std::vector<float> position;       // 3: world
  std::vector<float> log_scale;      // 3: scale = exp
  std::vector<float> rotation;       // 4: quaternion w x y z, not normalised
  std::vector<float> opacity_logit;  // 1: opacity = sigmoid
  // Spherical harmonics, (degree + 1)^2 coefficients; the value of a channel is 0.5 + sum for L',
  // and kNeutralChroma + sum for a' and b' (so all-zero chroma coefficients are exactly neutral).
  // In kSrgb they are those of R, G and B, all around 0.5.
  std::vector<float> sh_l;
  std::vector<float> sh_a;  // empty when channels == 1
  std::vector<float> sh_b;
  // 1: confidence of the colour, 0..1 (1: seen in a key view, 0.5: inferred, 0: guessed). Empty if
  // unknown; no kernel uses it.
  std::vector<float> confidence;
  // At most one of the two deformations: motion of the last motion.size() Gaussians, those before
  // are static; or a field that deforms all of them.
  GaussianMotion motion;
  HexPlaneField hexplane;

  size_t size() const { return opacity_logit.size(); }
  bool IsDynamic() const { return MovingCount() > 0; }
  // Number of Gaussians that depend on time: the last ones.
  size_t MovingCount() const { return hexplane.empty() ? motion.size() : size(); }
  // Time span of the deformation, seconds of the scene.
  double begin_s() const { return hexplane.empty() ? motion.begin_s : hexplane.shape.begin_s; }
  double end_s() const { return hexplane.empty() ? motion.end_s : hexplane.shape.end_s; }
};

// One Gaussian per sparse point: scale from the mean distance to its 3 nearest neighbours, opacity
// 0.1, luminance 0.5. Throws Error{kInvalidArgument} when the scene has no points.
GaussianModel InitialGaussians(const Scene& scene);

// Native file with a versioned header and a checksum: the whole model, bit for bit. Version 1 has
// no confidence, version 2 has it, version 3 (with or without it) has motion, version 4 is in
// kSrgb, version 5 (with or without confidence) has a field.
std::string SerializeGaussians(const GaussianModel& model);
// Throws Error{kInvalidArgument} on anything else (wrong magic, newer version, truncated, NaN).
GaussianModel ParseGaussians(std::string_view bytes);

}  // namespace color3d
