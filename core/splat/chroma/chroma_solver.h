// Least absolute residuals of chroma (chroma_system.h): a few ordered-subsets sweeps, which step
// once per view and converge fast at first, then rounds of reweighting with block-Jacobi
// preconditioned conjugate gradients on the normal equations of all views. Regularization towards
// the closed form keeps Gaussians that few pixels see well-posed. Internal to the splat module.
#pragma once

#include <vector>

#include "core/splat/chroma/chroma_fitting.h"
#include "core/splat/chroma/chroma_system.h"

namespace color3d {

// Improves `parameters` (the closed form) in place; Gaussians that are not `seen` are unchanged.
// Reports the curves "train_l1_ab" (Lab units, per pixel) and "chroma_residual" (norm of the
// gradient relative to the right-hand side, in the preconditioner's metric).
void SolveChroma(const ChromaFitting& fitting,
                 const std::vector<char>& seen,
                 ChromaSystem& system,
                 ChromaParameters& parameters);

}  // namespace color3d
