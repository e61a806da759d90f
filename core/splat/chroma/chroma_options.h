// Options of fitting chroma. A plain value; the defaults are those of the service's preset "fast".
#pragma once

#include <cstdint>

#include "core/splat/chroma/chroma_adjustment.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

struct ChromaOptions {
  // kJoint: continues the training of the geometry on luminance and chroma (GAUSSIANS.md "Joint
  // training"), by the options of that training.
  enum class Solver { kConjugateGradients, kAdam, kJoint };
  Solver solver = Solver::kConjugateGradients;
  // 0..100000. Iterations of Adam, or at most this many of conjugate gradients (which stop by
  // themselves, see below). 0: closed form only.
  int iterations = 300;
  int chroma_sh_degree = 0;                   // 0..3
  ColorSpace color_space = ColorSpace::kLab;  // kSrgb: kJoint only, and without adjustment
  double ssim_weight = 0.2;                   // of Adam's loss, 0..1
  double time_limit_seconds = 0.0;  // 0: none; 0..86400. Ends in time with the best result so far
  uint64_t seed = 1;                // of Adam

  // Conjugate gradients. True: least absolute residuals, by reweighting; false: least squares.
  bool robust = true;
  int sweeps = 3;                      // ordered-subsets sweeps before them, 0..1000
  int rounds = 6;                      // of reweighting, at most, 0..1000
  int steps_per_round = 10;            // of conjugate gradients, at most, 1..1000
  double residual_tolerance = 0.05;    // a round ends when its residual has shrunk to this, 0..1
  double objective_tolerance = 0.025;  // ... and all when a round improves L1 by less, 0..1: later
                                       // rounds fit noise that held-out views do not share
  // Regularization towards the closed form, with the weight of this many pixels of the Gaussian
  // alone, 1e-6..1e6; multiplied by tikhonov_rest for coefficients above degree 0, 1..1e6.
  double tikhonov = 0.01;
  double tikhonov_rest = 10.0;
  // Byte budgets, each 0..1e15: of blending weights kept with their view's targets, and of targets
  // of the other views. All others are recomputed and reread.
  int64_t memory_budget_bytes = int64_t{2} << 30;
  int64_t target_budget_bytes = int64_t{512} << 20;

  ChromaAdjustment adjustment;  // applied to the solution

  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const ChromaOptions&) const = default;
};

// Small budgets, so that memory does not grow with the number of frames. The result is the same.
ChromaOptions ForManyFrames(ChromaOptions options);

}  // namespace color3d
