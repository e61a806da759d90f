#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/geometry/training_schedule.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/training/held_out.h"
#include "tests/support/splat_scene.h"

namespace color3d {
namespace {

using testing_scene::MakeRoomCorner;
using testing_scene::ProceduralScene;

GeometryProblem ColourProblemOf(const ProceduralScene& s, int held_out) {
  GeometryProblem problem;
  for (int i = 0; i < static_cast<int>(s.scene.views.size()); ++i) {
    const PosedCamera posed{i, s.scene.views[i].camera, s.scene.views[i].cam_from_world};
    (i == held_out ? problem.held_out : problem.training).push_back(posed);
  }
  problem.colours = [&s](int view) {
    return std::make_shared<const Image>(SrgbFromLab(s.lab[view]));
  };
  problem.extent = s.scene.Extent();
  return problem;
}

GeometryOptions SmallOptions() {
  GeometryOptions options;
  options.iterations = 200;
  options.max_gaussians = 2500;
  options.sh_degree = 1;
  return options;
}

GaussianModel TrainOn(const GeometryProblem& problem,
                      const ProceduralScene& s,
                      const GeometryOptions& options,
                      CheckpointStore& store,
                      ProgressObserver& observer,
                      const CancellationToken& cancel,
                      TrainingTrace* trace) {
  ThreadPool pool(2);
  return TrainGeometryOn(problem,
                         InitialGaussians(s.scene),
                         options,
                         TuningOf(options),
                         pool,
                         store,
                         observer,
                         cancel,
                         trace);
}

TEST(TrainOnColoursTest, LearnsAViewItNeverSawInRgb) {
  const ProceduralScene s = MakeRoomCorner(6, 96, 72, 800);
  TrainingTrace trace;
  int pictures = 0;
  double error = 0.0;
  trace.on_held_out_picture = [&](int view, const Image& drawn) {
    ++pictures;
    EXPECT_EQ(view, 3);
    const Image truth = SrgbFromLab(s.lab[view]);
    ASSERT_EQ(drawn.data.size(), truth.data.size());
    for (size_t i = 0; i < truth.data.size(); ++i) error += std::abs(drawn.data[i] - truth.data[i]);
    error /= static_cast<double>(truth.data.size());
  };
  NoCheckpoints none;
  NullObserver observer;
  const GaussianModel model = TrainOn(
      ColourProblemOf(s, 3), s, SmallOptions(), none, observer, CancellationToken(), &trace);
  EXPECT_EQ(model.channels, 3);
  EXPECT_EQ(model.sh_a.size(), 4 * model.size());
  EXPECT_EQ(pictures, 1);
  ASSERT_GE(trace.held_out.size(), 5u);
  EXPECT_GT(trace.held_out.back().psnr_db, 17.5);
  EXPECT_GT(trace.held_out.back().psnr_db, trace.held_out.front().psnr_db + 3.0);
  EXPECT_GT(trace.held_out.back().ssim, trace.held_out.front().ssim);
  EXPECT_NEAR(trace.held_out.back().l1, error, 1e-4);
  EXPECT_EQ(trace.held_out.back().iteration, 200);
  EXPECT_EQ(trace.iterations, 200);
  EXPECT_EQ(trace.gaussians, static_cast<int64_t>(model.size()));
}

TEST(TrainOnColoursTest, PhasesAddUpToTrainingTimeWithoutEvaluation) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 400);
  TrainingTrace trace;
  NoCheckpoints none;
  NullObserver observer;
  TrainOn(ColourProblemOf(s, 1), s, SmallOptions(), none, observer, CancellationToken(), &trace);
  const double evaluation = trace.phases[static_cast<int>(Phase::kEvaluation)];
  EXPECT_GT(evaluation, 0.0);
  const double sum = std::accumulate(trace.phases.begin(), trace.phases.end(), -evaluation);
  EXPECT_NEAR(sum, trace.seconds, 1e-9);
  for (const Phase p : {Phase::kForward, Phase::kBackward, Phase::kAdam, Phase::kDensify}) {
    EXPECT_GT(trace.phases[static_cast<int>(p)], 0.0);
  }
}

class LastMessage : public NullObserver {
 public:
  void OnProgress(int64_t step, int64_t total, const std::string& message) override {
    step_ = step;
    total_ = total;
    message_ = message;
  }
  int64_t step_ = 0, total_ = 0;
  std::string message_;
};

TEST(TimeLimitTest, EndsTheWholeScheduleLongBeforeTheIterationsRunOut) {
  const ProceduralScene s = MakeRoomCorner(4, 160, 130, 400);
  GeometryOptions options = SmallOptions();
  options.iterations = 100'000;
  options.time_limit_seconds = 0.6;
  TrainingTrace trace;
  NoCheckpoints none;
  LastMessage last;
  const GaussianModel model =
      TrainOn(ColourProblemOf(s, -1), s, options, none, last, CancellationToken(), &trace);
  EXPECT_LT(trace.iterations, 50'000);
  EXPECT_GE(trace.seconds, 0.6);
  EXPECT_LT(trace.seconds, 5.0);
  EXPECT_EQ(last.step_, last.total_);
  EXPECT_EQ(last.step_, trace.iterations);
  EXPECT_THAT(last.message_, testing::HasSubstr("160x130 px"));
  EXPECT_GT(model.size(), 200u);
}

// Saves and cancels after some time.
class StopAfter : public CheckpointStore {
 public:
  StopAfter(double seconds, CancellationToken& cancel) : seconds_(seconds), cancel_(cancel) {}
  std::optional<std::string> Load() override { return std::nullopt; }
  bool WantsSave() override { return clock_.TrainingSeconds() > seconds_; }
  void Save(const std::string& state) override {
    saved = state;
    cancel_.Cancel();
  }
  std::string saved;

 private:
  double seconds_;
  CancellationToken& cancel_;
  PhaseClock clock_;
};

class Saved : public NoCheckpoints {
 public:
  explicit Saved(std::string state) : state_(std::move(state)) {}
  std::optional<std::string> Load() override { return state_; }

 private:
  std::string state_;
};

TEST(TimeLimitTest, EarlierAttemptsCount) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 48, 200);
  const GeometryProblem problem = ColourProblemOf(s, -1);
  GeometryOptions options = SmallOptions();
  options.iterations = 100'000;
  options.time_limit_seconds = 1.0;
  NullObserver observer;
  CancellationToken cancel;
  StopAfter first(0.4, cancel);
  EXPECT_THROW(TrainOn(problem, s, options, first, observer, cancel, nullptr), Error);
  Saved second(first.saved);
  TrainingTrace trace;
  TrainOn(problem, s, options, second, observer, CancellationToken(), &trace);
  EXPECT_LT(trace.seconds, 0.9);
}

TEST(TimeLimitTest, OutOfRangeIsRefused) {
  for (const double bad : {-1.0, 86'401.0, std::numeric_limits<double>::quiet_NaN()}) {
    GeometryOptions options;
    options.time_limit_seconds = bad;
    EXPECT_THROW(options.Validate(), Error);
  }
}

TEST(TrainingScheduleTest, TheFartherOfTimeAndIterationsDrivesIt) {
  GeometryOptions options;
  options.iterations = 1000;
  const GeometryTuning tuning;
  const TrainingSchedule untimed(options, tuning, 1.0);
  EXPECT_DOUBLE_EQ(untimed.Fraction(250, 1e9), 0.25);
  GeometryOptions timed_options = options;
  timed_options.time_limit_seconds = 20.0;
  const TrainingSchedule timed(timed_options, tuning, 1.0);
  EXPECT_DOUBLE_EQ(timed.Fraction(250, 1.0), 0.25);
  EXPECT_DOUBLE_EQ(timed.Fraction(250, 10.0), 0.5);
  EXPECT_DOUBLE_EQ(timed.Fraction(250, 30.0), 1.0);
  EXPECT_DOUBLE_EQ(timed.Fraction(2000, 0.0), 1.0);
}

TEST(TrainingScheduleTest, EndsAtFullSizeWithTheLastRatesAndAllHarmonics) {
  const GeometryOptions options;
  const GeometryTuning tuning;
  const TrainingSchedule schedule(options, tuning, 2.0);
  Camera camera;
  camera.width = 500;
  camera.height = 375;
  EXPECT_GT(schedule.Level(0.0, camera), 0);
  EXPECT_EQ(schedule.Level(0.999, camera), 0);
  EXPECT_EQ(schedule.ActiveDegree(0.0), 0);
  EXPECT_EQ(schedule.ActiveDegree(0.999), options.sh_degree);
  EXPECT_NEAR(schedule.PositionRate(1.0), 2.0 * tuning.position_rate_last, 1e-9);
  const std::vector<float> rates = schedule.LearningRates(1.0, 3);
  ASSERT_EQ(rates.size(), static_cast<size_t>(kColorRow + 3 * 9));
  EXPECT_FLOAT_EQ(rates[kColorRow], rates[kColorRow + 9]);
  EXPECT_GT(rates.back(), 0.0f);
  EXPECT_EQ(schedule.TargetCount(0.0, 1000), 1000);
  EXPECT_EQ(schedule.TargetCount(1.0, 1000), options.max_gaussians);
  camera.width = camera.height = 90;  // too small to be halved
  EXPECT_EQ(schedule.Level(0.0, camera), 0);
}

TEST(TrainingScheduleTest, ThePapersTimesAreIterations) {
  GeometryOptions options;
  options.recipe = GeometryOptions::Recipe::kPaper;
  options.iterations = 15'000;
  options.sh_degree = 3;
  const GeometryTuning tuning = TuningOf(options);
  const TrainingSchedule schedule(options, tuning, 1.0);
  std::vector<int> densified, resets;
  for (int i = 1; i <= options.iterations; ++i) {
    const double before = schedule.Fraction(i - 1, 0.0), now = schedule.Fraction(i, 0.0);
    if (schedule.DensifyDue(before, now)) densified.push_back(i);
    if (schedule.OpacityResetDue(before, now)) resets.push_back(i);
  }
  ASSERT_GE(densified.size(), 70u);
  EXPECT_NEAR(densified.front(), 500, 1);
  EXPECT_NEAR(densified[1] - densified[0], 100, 1);
  EXPECT_NEAR(densified.back(), 7500, 1);
  EXPECT_THAT(resets, testing::SizeIs(2));
  EXPECT_NEAR(resets[0], 3000, 1);
  EXPECT_EQ(schedule.ActiveDegree(schedule.Fraction(999, 0.0)), 0);
  EXPECT_EQ(schedule.ActiveDegree(schedule.Fraction(3001, 0.0)), 3);
  Camera camera;
  camera.width = camera.height = 1000;
  EXPECT_EQ(schedule.Level(0.0, camera), 0);
}

TEST(TrainingScheduleTest, AShortTimeLimitHoldsBackTheNumberOfGaussians) {
  GeometryOptions options;
  options.iterations = 100'000;
  options.max_gaussians = 50'000;
  GeometryTuning tuning;
  tuning.wanted_iterations = 1000;
  const TrainingSchedule untimed(options, tuning, 1.0);
  EXPECT_EQ(untimed.AffordableCount(0.5, 10, 1.0, 0, 1000), 50'000);
  GeometryOptions timed_options = options;
  timed_options.time_limit_seconds = 10.0;
  const TrainingSchedule timed(timed_options, tuning, 1.0);
  // 9 s are left for 900 iterations.
  EXPECT_NEAR(timed.AffordableCount(0.1, 100, 0.005, 0, 1000), 2000, 1);
  EXPECT_LT(timed.AffordableCount(0.1, 100, 0.005, 1, 1000), 2000);
  EXPECT_EQ(timed.AffordableCount(0.1, 100, 0.5, 0, 1000), 1000);
  EXPECT_EQ(timed.AffordableCount(0.1, 100, 1e-9, 0, 1000), 50'000);
}

TEST(CompareClampedTest, ClampsBeforeItCompares) {
  PlaneBuffer drawn(20, 18, 3), truth(20, 18, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 18; ++y) {
      for (int x = 0; x < 20; ++x) {
        drawn.Row(c, y)[x] = 1.5f;
        truth.Row(c, y)[x] = c == 0 ? 0.9f : 1.0f;
      }
    }
  }
  ImageLoss loss;
  ThreadPool pool(1);
  const PictureQuality quality = CompareClamped(truth, loss, pool, drawn);
  EXPECT_NEAR(quality.psnr_db, -10.0 * std::log10(0.01 / 3.0), 1e-3);
  EXPECT_NEAR(quality.l1, 0.1 / 3.0, 1e-5);
  EXPECT_EQ(drawn.Row(1, 3)[4], 1.0f);
}

}  // namespace
}  // namespace color3d
