// Lab Gaussian reconstruction, second half: chroma on fixed geometry (GAUSSIANS.md "Stage 2").
// Deterministic for a seed and a thread count.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/training/posed_camera.h"

namespace color3d {

// Target chroma of one training view at the working size: 2 channels (Lab units), an optional
// 1-channel weight 0..1 (empty: all 1), and the confidence of the colour, 1 channel 0..1 (empty:
// unknown).
struct ChromaTarget {
  Image ab;
  Image weight;
  Image confidence;
};
// Returns null for a view without colours. Must return the same target for a view at every call;
// called often and by several threads at once.
using ChromaTargetSource = std::function<std::shared_ptr<const ChromaTarget>(int view)>;

// Receives a function that returns the current model.
using ChromaSnapshot =
    std::function<void(int64_t iteration, const std::function<GaussianModel()>& model)>;

struct ChromaProblem {
  std::vector<PosedCamera> training;
  ChromaTargetSource targets;
  // For measurements, may be empty. Called after the closed form, after every round of conjugate
  // gradients and at growing intervals of Adam.
  ChromaSnapshot snapshot;
};

// The training views of `scene` at the working size of `images`.
ChromaProblem ChromaProblemOf(const Scene& scene,
                              const ViewImages& images,
                              ChromaTargetSource targets);

// Expands a 1-channel model to L', a', b' and fits chroma with geometry fixed: closed form first
// (visibility-weighted mean per Gaussian), then least absolute residuals of a', b' by
// ordered-subsets sweeps and reweighted conjugate gradients, or Adam on 0.8 L1 + 0.2 (1 - SSIM).
// Gaussians that no training view sees take the chroma of their nearest visible neighbours. If all
// targets have a confidence, the model's confidence is its mean over the pixels that show the
// Gaussian, weighted as in the closed form, and 0 for Gaussians that no view sees. Curves:
// "train_l1_ab" (Lab units) and, with conjugate gradients, "chroma_residual" (relative). Throws
// Error{kInvalidArgument} for targets whose size differs from the view's camera or whose values are
// not finite, Error{kCancelled}.
GaussianModel FitChroma(const GaussianModel& geometry,
                        const ChromaProblem& problem,
                        const ChromaOptions& options,
                        const RunControl& run);

}  // namespace color3d
