#include "core/splat/geometry/geometry_trainer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/raster/render.h"
#include "tests/support/scenes/splat_scene.h"

namespace color3d {
namespace {

using testing_scene::MakeRoomCorner;
using testing_scene::ProceduralScene;

class Recorder : public ProgressObserver {
 public:
  void OnProgress(int64_t step, int64_t, const std::string&) override { last_step = step; }
  void OnError(int64_t, const std::string& name, double value) override {
    EXPECT_TRUE(std::isfinite(value));
    errors[name].push_back(value);
  }
  void OnWarning(const std::string& message) override { warnings.push_back(message); }
  int64_t last_step = 0;
  std::map<std::string, std::vector<double>> errors;
  std::vector<std::string> warnings;
};

// Saves once, at call `save_after` of WantsSave(), and then cancels the work.
class SaveThenStop : public CheckpointStore {
 public:
  SaveThenStop(int save_after, CancellationToken* cancel) : left_(save_after), cancel_(cancel) {}
  std::optional<std::string> Load() override { return saved; }
  bool WantsSave() override { return cancel_ != nullptr && --left_ == 0; }
  void Save(const std::string& state) override {
    saved = state;
    cancel_->Cancel();
  }
  std::optional<std::string> saved;

 private:
  int left_;
  CancellationToken* cancel_;
};

GeometryProblem ProblemOf(const ProceduralScene& s, int held_out) {
  GeometryProblem problem;
  for (int i = 0; i < static_cast<int>(s.scene.views.size()); ++i) {
    const PosedCamera posed{i, s.scene.views[i].camera, s.scene.views[i].cam_from_world};
    (i == held_out ? problem.held_out : problem.training).push_back(posed);
  }
  problem.luminance = [&s](int view) { return s.Luminance(view); };
  problem.initial = InitialGaussians(s.scene);
  problem.extent = s.scene.Extent();
  return problem;
}

GeometryOptions SmallOptions(int iterations) {
  GeometryOptions options;
  options.iterations = iterations;
  options.max_gaussians = 3000;
  options.sh_degree = 1;
  return options;
}

TEST(TrainGeometryTest, RaisesPsnrOfHeldOutView) {
  const ProceduralScene s = MakeRoomCorner(7, 96, 72, 800);
  const GeometryProblem problem = ProblemOf(s, 3);
  ThreadPool pool(2);
  NoCheckpoints none;
  Recorder recorder;
  const GaussianModel model =
      TrainGeometry(problem, SmallOptions(300), {pool, none, recorder, CancellationToken()});
  const std::vector<double>& psnr = recorder.errors["heldout_psnr_l_db"];
  ASSERT_GE(psnr.size(), 5u);
  EXPECT_GT(psnr.back(), 24.0);
  EXPECT_GT(psnr.back(), psnr.front() + 3.0);
  EXPECT_LE(model.size(), 3000u);
  EXPECT_EQ(recorder.last_step, 300);
  EXPECT_THAT(recorder.warnings, testing::IsEmpty());
  EXPECT_LT(recorder.errors["train_l1_l"].back(), 0.5 * recorder.errors["train_l1_l"].front());
  // The depth is that of the walls.
  const RenderedView view =
      RenderView(model, s.scene.views[3].camera, s.scene.views[3].cam_from_world, pool);
  EXPECT_EQ(view.lab.channels, 1);
  EXPECT_GT(view.opacity.At(0, 36, 48), 0.9f);
  EXPECT_NEAR(view.depth.At(0, 36, 48), 3.1f, 0.5f);
}

// Every photo shows an object in front of the room: a bright one on the left, or a dark one on the
// right. The held-out view is without one.
TEST(TrainGeometryTest, IgnoresMaskedPixels) {
  const ProceduralScene s = MakeRoomCorner(7, 96, 72, 800);
  std::vector<std::shared_ptr<const Image>> masks;
  for (int view = 0; view < 7; ++view) {
    Image mask(96, 72, 1, 1.0f);
    const int left = 4 + 29 * (view % 2), top = view % 2 == 0 ? 6 : 36;
    for (int y = top; y < top + 30; ++y) {
      for (int x = left; x < left + 30; ++x) mask.At(0, y, x) = 0.0f;
    }
    masks.push_back(view == 3 ? nullptr : std::make_shared<const Image>(mask));
  }
  const auto psnr = [&](bool spoilt, bool masked) {
    GeometryProblem problem = ProblemOf(s, 3);
    if (spoilt) {
      problem.luminance = [&](int view) {
        auto picture = std::make_shared<Image>(*s.Luminance(view));
        for (size_t i = 0; masks[view] != nullptr && i < picture->data.size(); ++i) {
          if (masks[view]->data[i] == 0.0f) picture->data[i] = view % 2 == 0 ? 95.0f : 5.0f;
        }
        return picture;
      };
    }
    if (masked) problem.mask = [&](int view) { return masks[view]; };
    ThreadPool pool(2);
    NoCheckpoints none;
    Recorder recorder;
    TrainGeometry(problem, SmallOptions(200), {pool, none, recorder, CancellationToken()});
    EXPECT_THAT(recorder.warnings, testing::IsEmpty());
    return recorder.errors["heldout_psnr_l_db"].back();
  };
  const double spoilt = psnr(true, false), masked = psnr(true, true), clean = psnr(false, false);
  EXPECT_EQ(psnr(false, true), masked) << "what is masked out leaks";
  EXPECT_GT(masked, spoilt + 5.0);
  EXPECT_GT(masked, clean - 1.5);  // half of the views show less
}

// One camera does not determine depth: parameters along it are unchanged.
TEST(TrainGeometryTest, TrainsRelief) {
  ProceduralScene s = MakeRoomCorner(2, 96, 72, 800);
  const Pose looks_from = s.scene.views[0].cam_from_world;
  for (SparsePoint& point : s.scene.points) point.position = looks_from.Apply(point.position);
  std::erase_if(s.scene.points, [](const SparsePoint& p) { return !(p.position.z() > 0.1); });
  GeometryProblem problem = ProblemOf(s, 1);
  problem.training[0].cam_from_world = Pose();
  problem.held_out.clear();
  problem.is_relief = true;
  ThreadPool pool(2);
  NoCheckpoints none;
  Recorder recorder;
  const RunControl run{pool, none, recorder, CancellationToken()};
  GeometryOptions options = SmallOptions(60);  // before any is added or removed
  options.max_gaussians = static_cast<int>(problem.initial.size());
  const GaussianModel model = TrainGeometry(problem, options, run);
  ASSERT_EQ(model.size(), problem.initial.size());
  double moved = 0.0;
  for (size_t i = 0; i < model.size(); ++i) {
    EXPECT_EQ(model.position[3 * i + 2], problem.initial.position[3 * i + 2]);
    EXPECT_EQ(model.log_scale[3 * i + 2], problem.initial.log_scale[3 * i + 2]);
    EXPECT_EQ(model.rotation[4 * i + 1], 0.0f);
    EXPECT_EQ(model.rotation[4 * i + 2], 0.0f);
    moved += std::abs(model.position[3 * i] - problem.initial.position[3 * i]);
  }
  EXPECT_GT(moved, 0.0);
}

TEST(TrainGeometryTest, KeepsGaussianCap) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 64, 500);
  ThreadPool pool(2);
  NoCheckpoints none;
  for (const int cap : {200, 700}) {
    GeometryOptions options = SmallOptions(60);
    options.max_gaussians = cap;
    options.densify_gradient = 1e-6;
    NullObserver observer;
    const GaussianModel model =
        TrainGeometry(ProblemOf(s, -1), options, {pool, none, observer, CancellationToken()});
    EXPECT_LE(model.size(), static_cast<size_t>(cap));
    EXPECT_GT(model.size(), static_cast<size_t>(cap / 2));
  }
}

std::string TrainFor(const ProceduralScene& s,
                     CheckpointStore& store,
                     const CancellationToken& cancel) {
  ThreadPool pool(2);
  NullObserver observer;
  return SerializeGaussians(
      TrainGeometry(ProblemOf(s, 1), SmallOptions(40), {pool, store, observer, cancel}));
}

TEST(TrainGeometryTest, ResumesBitForBit) {
  const ProceduralScene s = MakeRoomCorner(5, 64, 64, 400);
  CancellationToken cancel;
  SaveThenStop half(20, &cancel);
  EXPECT_THROW(TrainFor(s, half, cancel), Error);
  ASSERT_TRUE(half.saved.has_value());
  SaveThenStop second(0, nullptr);
  second.saved = half.saved;
  NoCheckpoints none;
  const std::string straight = TrainFor(s, none, CancellationToken());
  EXPECT_EQ(TrainFor(s, second, CancellationToken()), straight);
}

TEST(TrainGeometryTest, RestartsWithWarningOnDamagedCheckpoint) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  SaveThenStop store(0, nullptr);
  store.saved =
      "rubbish that is long enough to hold a digest, or so it seems at first sight, but no";
  ThreadPool pool(1);
  Recorder recorder;
  TrainGeometry(ProblemOf(s, -1), SmallOptions(5), {pool, store, recorder, CancellationToken()});
  EXPECT_THAT(recorder.warnings, testing::ElementsAre(testing::HasSubstr("starts afresh")));
  EXPECT_EQ(recorder.last_step, 5);
}

TEST(TrainGeometryTest, RestartsOnCheckpointOfOtherTuning) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  CancellationToken cancel;
  SaveThenStop store(10, &cancel);
  ThreadPool pool(2);
  NullObserver observer;
  GeometryOptions options = SmallOptions(20);
  EXPECT_THROW(TrainGeometry(ProblemOf(s, -1), options, {pool, store, observer, cancel}), Error);
  ASSERT_TRUE(store.saved.has_value());
  options.tuning.emplace().dc_rate = 2e-2;
  Recorder recorder;
  SaveThenStop again(0, nullptr);
  again.saved = store.saved;
  TrainGeometry(ProblemOf(s, -1), options, {pool, again, recorder, CancellationToken()});
  EXPECT_THAT(recorder.warnings, testing::ElementsAre(testing::HasSubstr("starts afresh")));
}

struct Refusal {
  ErrorCode code = ErrorCode::kCancelled;
  std::string message;
};

// Returns the error of training on `problem`; a test failure without one.
Refusal RefusalOf(const GeometryProblem& problem, Recorder& recorder) {
  ThreadPool pool(2);
  NoCheckpoints none;
  try {
    TrainGeometry(problem, SmallOptions(50), {pool, none, recorder, CancellationToken()});
  } catch (const Error& e) {
    return {e.code(), e.what()};
  }
  ADD_FAILURE() << "training succeeded";
  return {};
}

TEST(TrainGeometryTest, NamesPositionOfNaNInPicture) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  GeometryProblem problem = ProblemOf(s, -1);
  problem.luminance = [&s](int view) {
    auto picture = std::make_shared<Image>(*s.Luminance(view));
    if (view == 1) picture->At(0, 5, 7) = std::numeric_limits<float>::quiet_NaN();
    return picture;
  };
  Recorder recorder;
  const Refusal refusal = RefusalOf(problem, recorder);
  EXPECT_EQ(refusal.code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refusal.message, testing::HasSubstr("view 1: the pixel at 7, 5"));
}

// An extent with which every step overflows, even at the lowest rate.
TEST(TrainGeometryTest, RestoresLastGoodStateThenGivesUp) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  GeometryProblem problem = ProblemOf(s, -1);
  problem.extent = 1e60;
  Recorder recorder;
  EXPECT_EQ(RefusalOf(problem, recorder).code, ErrorCode::kInternal);
  EXPECT_THAT(recorder.warnings, testing::Contains(testing::HasSubstr("not finite")));
  EXPECT_THAT(recorder.errors["restored_non_finite"], testing::SizeIs(testing::Ge(1u)));
}

TEST(TrainGeometryTest, HugeLearningRatesStayFinite) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  GeometryOptions options = SmallOptions(80);
  options.learning_rate_scale = 1000.0;
  ThreadPool pool(2);
  NoCheckpoints none;
  Recorder recorder;
  const GaussianModel model =
      TrainGeometry(ProblemOf(s, -1), options, {pool, none, recorder, CancellationToken()});
  for (const float v : model.position) EXPECT_TRUE(std::isfinite(v));
  for (const float v : model.log_scale) EXPECT_TRUE(std::isfinite(v));
}

GeometryProblem ColorProblemOf(const ProceduralScene& s, int held_out) {
  GeometryProblem problem = ProblemOf(s, held_out);
  problem.luminance = nullptr;
  problem.colors = [&s](int view) {
    return std::make_shared<const Image>(SrgbFromLab(s.lab[view]));
  };
  return problem;
}

GeometryOptions ColorOptions() {
  GeometryOptions options = SmallOptions(200);
  options.max_gaussians = 2500;
  return options;
}

TEST(TrainOnColorsTest, LearnsHeldOutViewInRgb) {
  const ProceduralScene s = MakeRoomCorner(6, 96, 72, 800);
  TrainingTrace trace;
  int pictures = 0;
  double error = 0.0;
  trace.on_picture = [&](int view, const Image& drawn) {
    ++pictures;
    EXPECT_EQ(view, 3);
    const Image truth = SrgbFromLab(s.lab[view]);
    ASSERT_EQ(drawn.data.size(), truth.data.size());
    for (size_t i = 0; i < truth.data.size(); ++i) error += std::abs(drawn.data[i] - truth.data[i]);
    error /= static_cast<double>(truth.data.size());
  };
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver observer;
  const GaussianModel model = TrainGeometry(
      ColorProblemOf(s, 3), ColorOptions(), {pool, none, observer, CancellationToken()}, &trace);
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

TEST(TrainOnColorsTest, PhasesAddUpToTrainingTime) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 400);
  TrainingTrace trace;
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver observer;
  TrainGeometry(
      ColorProblemOf(s, 1), ColorOptions(), {pool, none, observer, CancellationToken()}, &trace);
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

TEST(TimeLimitTest, CompletesScheduleWithinLimit) {
  const ProceduralScene s = MakeRoomCorner(4, 160, 130, 400);
  GeometryOptions options = ColorOptions();
  options.iterations = 100'000;
  options.time_limit_seconds = 0.6;
  TrainingTrace trace;
  ThreadPool pool(2);
  NoCheckpoints none;
  LastMessage last;
  const GaussianModel model = TrainGeometry(
      ColorProblemOf(s, -1), options, {pool, none, last, CancellationToken()}, &trace);
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

TEST(TimeLimitTest, CountsEarlierAttempts) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 48, 200);
  const GeometryProblem problem = ColorProblemOf(s, -1);
  GeometryOptions options = ColorOptions();
  options.iterations = 100'000;
  options.time_limit_seconds = 1.0;
  ThreadPool pool(2);
  NullObserver observer;
  CancellationToken cancel;
  StopAfter first(0.4, cancel);
  EXPECT_THROW(TrainGeometry(problem, options, {pool, first, observer, cancel}), Error);
  Saved second(first.saved);
  TrainingTrace trace;
  TrainGeometry(problem, options, {pool, second, observer, CancellationToken()}, &trace);
  EXPECT_LT(trace.seconds, 0.9);
}

}  // namespace
}  // namespace color3d
