// The bound of the paper's appendix (Proposition 1) on the difference of a surface's colours in two
// views, beside what is observed. Notation: the colorizer is F = psi(phi(I)), I a patch of L, phi
// the encoder, psi the decoder. Torch in the interface. Not thread-safe.
#pragma once

#include <torch/types.h>

#include <array>
#include <cstdint>
#include <vector>

#include "core/colorizer/model/personal_model.h"
#include "core/encoder/tap_encoder.h"

namespace color3d {

// phi and psi for patches. With adapters phi is the adapted encoder.
class PatchColorizer {
 public:
  // `model` and `encoder` must outlive the object. Requires: patch_px is a multiple of the last
  // tap's stride.
  PatchColorizer(const PersonalModel& model, const TapEncoder& encoder, int patch_px);

  int patch_px() const { return patch_px_; }
  // Returns phi [B,d] of L [B,1,p,p] in units of 100: all taps, and L itself, which psi reads.
  // Differentiable.
  torch::Tensor Encode(const torch::Tensor& patches) const;
  // Returns psi [B,2] of phi: ab at the patch's centre, Lab units. Differentiable.
  torch::Tensor Decode(const torch::Tensor& codes) const;

 private:
  torch::Tensor Input(const torch::Tensor& luminance) const;

  const PersonalModel& model_;
  const TapEncoder& encoder_;
  int patch_px_;
  std::vector<std::array<int64_t, 3>> tap_shapes_;  // C, H, W
};

// Patches [B,1,p,p] of L / 100 around one surface point each.
struct PatchPairs {
  torch::Tensor first;   // I_v
  torch::Tensor second;  // I_v'
  torch::Tensor warped;  // T[I_v]: what the first view shows, as seen from the second
};

// Distances at one surface point.
struct PointDistances {
  double image = 0.0;         // |I_v - I_v'|
  double feature = 0.0;       // |phi(I_v) - phi(I_v')|
  double color = 0.0;         // |F(I_v) - F(I_v')|, Lab units
  double equivariance = 0.0;  // |phi(I_v) - phi(T[I_v])|: delta_eq of A2
  double rest_image = 0.0;    // |T[I_v] - I_v'|
  double rest_feature = 0.0;  // |phi(T[I_v]) - phi(I_v')|
};
std::vector<PointDistances> MeasurePoints(const PatchColorizer& colorizer, const PatchPairs& pairs);

// Largest norms of Jacobians at patches: local Lipschitz constants.
struct JacobianNorms {
  double encoder = 0.0;  // |J_phi|, L_phi
  double decoder = 0.0;  // |J_psi|, L_psi
  double whole = 0.0;    // |J_F|
};
// At `patches` [B,1,p,p].
JacobianNorms MeasureNorms(const PatchColorizer& colorizer,
                           const torch::Tensor& patches,
                           int iterations);

// Delta_c <= L_psi (L_phi |I_v - I_v'| + eps_phi + delta_eq).
struct ColorBound {
  int64_t points = 0;
  double color = 0.0;  // mean Delta_c, Lab units
  double largest_color = 0.0;
  double encoder_ratio = 0.0;  // largest feature / image
  double decoder_ratio = 0.0;  // largest color / feature
  double equivariance = 0.0;   // delta_eq: the largest
  double residual = 0.0;       // eps_phi: least that makes A1 hold with L_phi
  double bound = 0.0;          // mean
  double holds = 0.0;          // share of the points
};
// Requires: there are points.
ColorBound CompareWithBound(const std::vector<PointDistances>& points, const JacobianNorms& norms);

}  // namespace color3d
