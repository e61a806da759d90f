// Dynamic scenes with exact truth: held-out time steps rendered by geometry with a foreground,
// compared with static geometry. And Gaussians at times far from their own.
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/color/lab.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/motion/motion.h"
#include "core/splat/raster/render.h"
#include "tests/stability/tiny_problem.h"
#include "tests/support/random_block.h"
#include "tests/support/scenes/dynamic_scene.h"

namespace color3d {
namespace {

constexpr int kHoldOutEvery = 5;  // time steps, from the third on
constexpr double kPeakPsnr = 99.0;

struct MadeUp {
  explicit MadeUp(DynamicCase which) : scene(OptionsOf(which)) {}

  static DynamicSceneOptions OptionsOf(DynamicCase which) {
    DynamicSceneOptions options;
    options.which = which;
    options.supersampling = 1;
    return options;
  }

  // L in 0..100.
  std::shared_ptr<const Image> Luminance(int view) const {
    return std::make_shared<const Image>(LuminanceFromSrgb(scene.RenderSrgb(view)));
  }

  DynamicScene scene;
};

GeometryProblem ProblemOf(const MadeUp& made) {
  GeometryProblem problem;
  const Scene& scene = made.scene.scene();
  for (int camera = 0; camera < made.scene.cameras(); ++camera) {
    for (int time = 0; time < made.scene.times(); ++time) {
      const int index = made.scene.ViewOf(camera, time);
      const View& view = scene.views[index];
      const PosedCamera posed{
          index, view.camera, view.cam_from_world, view.time_s(), view.moment->shot};
      (time % kHoldOutEvery == kHoldOutEvery / 2 && made.scene.times() > 1 ? problem.held_out
                                                                           : problem.training)
          .push_back(posed);
    }
  }
  problem.luminance = [&made](int view) { return made.Luminance(view); };
  problem.initial = InitialGaussians(scene);
  problem.extent = scene.Extent();
  return problem;
}

struct Psnr {
  double all = kPeakPsnr;
  double movers = kPeakPsnr;  // of the foreground's pixels
};

Psnr PsnrOf(const MadeUp& made,
            const std::vector<PosedCamera>& views,
            const GaussianModel& model,
            ThreadPool& pool) {
  double sum[2] = {0.0, 0.0}, weight[2] = {0.0, 0.0};
  for (const PosedCamera& posed : views) {
    const Image drawn =
        RenderView(model, posed.camera, posed.cam_from_world, pool, 0.0f, posed.time_s).lab;
    const auto truth = made.Luminance(posed.view);
    const Image movers = made.scene.RenderMovers(posed.view);
    for (size_t i = 0; i < truth->data.size(); ++i) {
      const double error = 0.01 * (std::clamp(drawn.data[i], 0.0f, 100.0f) - truth->data[i]);
      const double share[2] = {1.0, movers.data[i]};
      for (int k = 0; k < 2; ++k) {
        sum[k] += share[k] * error * error;
        weight[k] += share[k];
      }
    }
  }
  const auto psnr = [&](int k) {
    return sum[k] > 0.0 ? std::min(kPeakPsnr, -10.0 * std::log10(sum[k] / weight[k])) : kPeakPsnr;
  };
  return {psnr(0), psnr(1)};
}

struct Trained {
  GaussianModel model;
  double seconds = 0.0;
};

Trained Train(const GeometryProblem& problem,
              GeometryOptions::Motion motion,
              TrainingWitness& witness,
              ThreadPool& pool) {
  GeometryOptions options;
  options.iterations = 600;
  options.max_gaussians = 6000;
  options.sh_degree = 1;
  options.motion = motion;
  NoCheckpoints none;
  TrainingTrace trace;
  Trained trained;
  const CancellationToken cancel;
  trained.model = TrainGeometry(problem, options, {pool, none, witness, cancel}, &trace);
  trained.seconds = trace.seconds;
  return trained;
}

StabilityResult RunMoving(DynamicCase which, ThreadPool& pool) {
  const MadeUp made(which);
  const GeometryProblem problem = ProblemOf(made);
  TrainingWitness witness;
  const Trained still = Train(problem, GeometryOptions::Motion::kStill, witness, pool);
  const Trained moving = Train(problem, GeometryOptions::Motion::kAuto, witness, pool);
  // An object that crosses the picture within three time steps cannot be predicted at a held-out
  // one.
  const bool foreseen = which != DynamicCase::kFast && which != DynamicCase::kOneStep;
  const std::vector<PosedCamera>& views = foreseen ? problem.held_out : problem.training;
  const Psnr before = PsnrOf(made, views, still.model, pool);
  const Psnr after = PsnrOf(made, views, moving.model, pool);
  StabilityResult result;
  result.condition_of = "-";
  result.non_finite =
      CountNonFinite(moving.model) + CountNonFinite(still.model) + witness.non_finite;
  result.compared = static_cast<int64_t>(moving.model.size());
  result.restores = witness.restores;
  if (IsMoving(which)) {
    result.held = moving.model.motion.size() > 0 && after.movers > before.movers &&
                  after.all > before.all - 0.1;
  } else {
    result.held = moving.model.motion.size() == 0 && after.all >= before.all - 0.1;
  }
  char text[200];
  std::snprintf(text,
                sizeof(text),
                "%s time steps %.1f dB (static %.1f), foreground %.1f dB (%.1f), %zu of %zu "
                "Gaussians move, %.2f x the seconds",
                foreseen ? "held-out" : "seen",
                after.all,
                before.all,
                after.movers,
                before.movers,
                moving.model.motion.size(),
                moving.model.size(),
                moving.seconds / still.seconds);
  result.outcome = text;
  return result;
}

// Gaussians at times up to the range of float32 from their own: visible or not, all stays finite.
StabilityResult FarMoments(ThreadPool& pool) {
  constexpr int kRows = kBlockRows;
  ParameterBlock moving(kRows + kMotionRows, kBlockCount);
  const ParameterBlock parameters = RandomBlock(5, 1.0);
  Random random(6);
  const float extremes[] = {0.0f, 1.0f, -1.0f, 1e-20f, 30.0f, -30.0f, 80.0f, -80.0f};
  for (int64_t i = 0; i < kBlockCount; ++i) {
    for (int r = 0; r < kRows; ++r) moving.Row(r)[i] = parameters.Row(r)[i];
    for (int r = 0; r < kMotionRows; ++r) {
      moving.Row(kRows + r)[i] = extremes[random.NextBelow(std::size(extremes))];
    }
  }
  StabilityResult result;
  result.condition_of = "-";
  for (const float t : {-1.0f, 0.0f, 1.0f, 1e4f}) {
    ParameterBlock at = parameters, gradient;
    ApplyMotion({moving, kRows, t, 0}, pool, at);
    // Only rendered Gaussians have a gradient.
    ParameterBlock d_at = RandomBlock(7, 1.0);
    for (int64_t i = 0; i < kBlockCount; ++i) {
      if (at.Row(kOpacityRow)[i] > -9.0f) continue;
      for (int r = 0; r < kRows; ++r) d_at.Row(r)[i] = 0.0f;
    }
    ApplyMotionBackward({moving, kRows, t, 0}, at, d_at, pool, gradient);
    for (const ParameterBlock* block : {&at, &gradient}) {
      for (int r = 0; r < block->rows(); ++r) {
        result.non_finite += CountNonFinite(block->Row(r), kBlockCount);
        result.compared += kBlockCount;
      }
    }
  }
  return result;
}

}  // namespace

void AddMotionCases(std::vector<StabilityCase>& cases) {
  for (const DynamicCase which : DynamicCases()) {
    cases.push_back({"motion", DynamicCaseName(which), false, [which](ThreadPool& pool) {
                       return RunMoving(which, pool);
                     }});
  }
  cases.push_back({"motion", "times far away", false, FarMoments});
}

}  // namespace color3d
