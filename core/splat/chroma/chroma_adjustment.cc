#include "core/splat/chroma/chroma_adjustment.h"

#include <algorithm>
#include <vector>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

// Lab: a = 500 (f(X) - f(Y)), b = 200 (f(Y) - f(Z)), f(Y) = (L + 16) / 116.
constexpr double kA = 500.0, kB = 200.0;
constexpr double kOffset = 16.0, kRange = 116.0, kMiddle = 50.0;
// Normalised: L' = L / 100, a' = a / 255 + neutral.
constexpr double kUnitL = 100.0, kUnitAb = 255.0;

// harmonics of a' or b' <- scale * them + per_l * (L + 16).
void Apply(double scale, double per_l, const GaussianModel& model, std::vector<float>* harmonics) {
  const int own = (model.chroma_sh_degree + 1) * (model.chroma_sh_degree + 1);
  const int of_l = (model.sh_degree + 1) * (model.sh_degree + 1);
  const double slope = per_l * kUnitL / kUnitAb;
  // L' is 0.5 + its harmonics.
  const double constant = per_l * (0.5 * kUnitL + kOffset) / kUnitAb / kShDc;
  for (size_t i = 0; i < model.size(); ++i) {
    for (int k = 0; k < own; ++k) {
      float& value = (*harmonics)[i * own + k];
      double adjusted = scale * value + (k == 0 ? constant : 0.0);
      if (k < of_l) adjusted += slope * model.sh_l[i * of_l + k];
      value = static_cast<float>(adjusted);
    }
  }
}

}  // namespace

void ChromaAdjustment::Validate() const {
  const RangeCheck check("chroma adjustment");
  check("saturation", saturation, 0.0, 4.0);
  check("tint", tint, -50.0, 50.0);
  check("warmth", warmth, -50.0, 50.0);
}

void AdjustChroma(const ChromaAdjustment& adjustment, GaussianModel* model) {
  adjustment.Validate();
  if (adjustment == ChromaAdjustment{}) return;
  if (model->color_space != ColorSpace::kLab) {
    throw InvalidArgument(
        "saturation {}, tint {} and warmth {} change a and b, but the model holds R, G and B; "
        "solve it with solve_chroma.color_space=lab",
        adjustment.saturation,
        adjustment.tint,
        adjustment.warmth);
  }
  // Gain of a neutral grey per unit of L + 16, and the factor on X or Z that produces it.
  const double a_per_l = adjustment.tint / (kMiddle + kOffset);
  const double b_per_l = adjustment.warmth / (kMiddle + kOffset);
  const double x_scale = 1.0 + a_per_l * kRange / kA;
  const double z_scale = 1.0 - b_per_l * kRange / kB;
  Apply(adjustment.saturation * x_scale, a_per_l, *model, &model->sh_a);
  Apply(adjustment.saturation * z_scale, b_per_l, *model, &model->sh_b);
}

}  // namespace color3d
