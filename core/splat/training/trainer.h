// The two halves of Lab Gaussian reconstruction: luminance geometry (the paper's warm-up, one
// channel), then chroma on it (METHOD.md "Stage 2"). Deterministic for a seed and a thread count.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

// The defaults of both structs are those of the service's preset "fast".
struct GeometryOptions {
  // kColor3d: coarse to fine, measured on CPUs. kPaper: the schedule of Kerbl et al. 2023.
  enum class Recipe { kColor3d, kPaper };
  Recipe recipe = Recipe::kColor3d;
  int iterations = 1500;  // 0..100000
  // Of training, 0: none, at most 86400. The whole schedule then fits into this time or the
  // iterations, whichever is used up first; the same input gives similar results, not the same.
  double time_limit_seconds = 0.0;
  int max_gaussians = 40'000;        // hard cap, 1..10,000,000
  int sh_degree = 2;                 // of luminance at the end, 0..3
  double ssim_weight = 0.2;          // lambda of (1 - SSIM), 0..1
  double edge_weight = 1.0;          // of the Charbonnier-Laplacian term, 0..10
  double densify_gradient = 5e-5;    // NDC units, 1e-9..1e9 (3DGS: 2e-4, for 30k iterations)
  double learning_rate_scale = 1.0;  // on all learning rates, 1e-3..1e3
  uint64_t seed = 1;
  void Validate() const;
  bool operator==(const GeometryOptions&) const = default;
};

struct ChromaOptions {
  enum class Solver { kConjugateGradients, kAdam };
  Solver solver = Solver::kConjugateGradients;
  // 0..100000. Of Adam; of conjugate gradients at most (they stop by themselves, see below). 0: the
  // closed form alone.
  int iterations = 300;
  int chroma_sh_degree = 0;         // 0..1
  double ssim_weight = 0.2;         // of Adam's loss, 0..1
  double time_limit_seconds = 0.0;  // 0: none; 0..86400. Ends on time with the best so far
  uint64_t seed = 1;                // of Adam

  // Conjugate gradients. Least absolute residuals, by reweighting; false: least squares.
  bool robust = true;
  int sweeps = 3;                      // ordered-subsets sweeps before, 0..1000
  int rounds = 6;                      // of reweighting, at most, 0..1000
  int steps_per_round = 10;            // of conjugate gradients, at most, 1..1000
  double residual_tolerance = 0.05;    // a round ends when its residual has shrunk to this, 0..1
  double objective_tolerance = 0.025;  // ... and all when a round improves L1 by less, 0..1: later
                                       // rounds fit noise that held-out views do not share
  // Pull to the closed form, as strong as this many pixels of the Gaussian alone, 1e-6..1e6; for
  // coefficients above degree 0, times tikhonov_rest, 1..1e6.
  double tikhonov = 0.01;
  double tikhonov_rest = 10.0;
  int64_t memory_budget_bytes = int64_t{2} << 30;  // of kept blending weights, 0..1e15
  void Validate() const;
  bool operator==(const ChromaOptions&) const = default;
};

// Trains on the training views of `scene` at the working size of `images`. Reports curves
// "train_l1_l" (running mean of |L'-L'_true|) and "heldout_psnr_l_db" (when there are held-out
// views, a few times). Resumes from and saves to `checkpoints`. Non-finite values never survive:
// the last good state is restored with a smaller step, and a warning tells. Throws
// Error{kInvalidArgument} for a scene without points in front of any camera, Error{kCancelled}.
GaussianModel TrainGeometry(const Scene& scene,
                            const ViewImages& images,
                            const GeometryOptions& options,
                            ThreadPool& pool,
                            CheckpointStore& checkpoints,
                            ProgressObserver& progress,
                            const CancellationToken& cancel);

// Target chroma of one training view at the working size: 2 channels (Lab units), an optional
// 1-channel weight 0..1 (empty: all 1), and how sure the colour is, 1 channel 0..1 (empty:
// unknown).
struct ChromaTarget {
  Image ab;
  Image weight;
  Image confidence;
};
using ChromaTargetSource = std::function<std::shared_ptr<const ChromaTarget>(int view)>;

// Expands a 1-channel model to L', a', b' and fits chroma with geometry fixed: closed form first
// (visibility-weighted mean per Gaussian), then least absolute residuals of a', b' by
// ordered-subsets sweeps and reweighted conjugate gradients, or Adam on 0.8 L1 + 0.2 (1 - SSIM).
// Gaussians that no training view sees get their nearest seen neighbours' chroma. When all targets
// say their confidence, the model's is its mean over the pixels that show the Gaussian, weighted as
// in the closed form, and 0 for one that no view sees. Curves:
// "train_l1_ab" (Lab units) and, of conjugate gradients, "chroma_residual" (relative). Throws
// Error{kInvalidArgument} for targets of another size than the view's camera or with values that
// are not finite, Error{kCancelled}.
GaussianModel FitChroma(const GaussianModel& geometry,
                        const Scene& scene,
                        const ViewImages& images,
                        const ChromaTargetSource& targets,
                        const ChromaOptions& options,
                        ThreadPool& pool,
                        CheckpointStore& checkpoints,
                        ProgressObserver& progress,
                        const CancellationToken& cancel);

}  // namespace color3d
