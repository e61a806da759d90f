// Lab Gaussian reconstruction: luminance geometry (the paper's warm-up, one channel), or luminance
// and chroma together (GAUSSIANS.md "Stage 2"). Deterministic for a seed and a thread count.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/geometry/geometry_problem.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/raster/phase_clock.h"

namespace color3d {

// Quality over the held-out views at a time of training. Pictures are clamped to 0..1 before the
// comparison; all views have equal weight.
struct HeldOutPoint {
  double seconds = 0.0;  // of training
  int64_t iteration = 0;
  int64_t gaussians = 0;
  double psnr_db = 0.0;  // from the squared error over all channels
  double ssim = 0.0;
  double l1 = 0.0;  // of values 0..1
};

// Measurements of a training.
struct TrainingTrace {
  // Called at the end for each held-out view, in order, and then for each training view if
  // `score_training` is set: the model's picture, clamped to 0..1.
  std::function<void(int view, const Image& drawn)> on_picture;
  double seconds = 0.0;  // of training in this attempt, without held-out evaluation
  int64_t iterations = 0;
  int64_t gaussians = 0;
  PhaseSeconds phases{};
  std::vector<HeldOutPoint> held_out;
  bool score_training = false;  // computes `training`
  HeldOutPoint training;        // the same over the training views, at the end
};

// Reports curves "train_l1_l" (running mean of |L'-L'_true|) and "heldout_psnr_l_db" (a few times,
// if there are held-out views). Resumes from and saves to the checkpoints. Non-finite values never
// survive: the last good state is restored with a smaller step and a warning. When training on
// colours the curves are "train_l1_rgb" and "heldout_psnr_rgb_db", or "train_l1_ab" (Lab units),
// and the result has 3 channels of GeometryProblem::color_space. Training on luminance ends at
// options.warm_up of the schedule. `trace` may be null, and so may `state`, which receives the
// state at the end. Throws Error{kInvalidArgument} without training views, Error{kCancelled}.
GaussianModel TrainGeometry(const GeometryProblem& problem,
                            const GeometryOptions& options,
                            const RunControl& run,
                            TrainingTrace* trace = nullptr,
                            GeometryState* state = nullptr);

}  // namespace color3d
