// Saturation and white balance of a coloured model. Pure functions, thread-safe.
#pragma once

#include "core/splat/model/gaussian_model.h"

namespace color3d {

// White balance is a von Kries scaling of X and Z. In Lab it is linear in L, a and b, as rendering
// is, and therefore exact on Gaussians, except for harmonics of L above chroma's degree.
struct ChromaAdjustment {
  double saturation = 1.0;  // factor on a and b, applied before the balance, 0..4
  double tint = 0.0;        // a and b given to a neutral grey of L = 50, Lab units, -50..50
  double warmth = 0.0;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const ChromaAdjustment&) const = default;
};

// Requires a model with chroma. The default adjustment keeps it bit for bit.
void AdjustChroma(const ChromaAdjustment& adjustment, GaussianModel* model);

}  // namespace color3d
