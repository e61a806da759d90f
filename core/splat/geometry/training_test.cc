#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "core/color/lab.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/splat/geometry/densify.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/raster/render.h"
#include "core/splat/training/training_state.h"
#include "tests/support/splat_scene.h"

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

// Saves once, after `save_after` questions whether to, and then cancels the work.
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

TEST(TrainGeometryTest, RaisesThePsnrOfAViewItNeverSaw) {
  const ProceduralScene s = MakeRoomCorner(7, 96, 72, 800);
  const GeometryProblem problem = ProblemOf(s, 3);
  ThreadPool pool(2);
  NoCheckpoints none;
  Recorder recorder;
  const GaussianModel model = TrainGeometryOn(problem,
                                              InitialGaussians(s.scene),
                                              SmallOptions(300),
                                              GeometryTuning(),
                                              pool,
                                              none,
                                              recorder,
                                              CancellationToken());
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

TEST(TrainGeometryTest, BothStrategiesKeepTheHardCap) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 64, 500);
  ThreadPool pool(2);
  NoCheckpoints none;
  for (const auto strategy :
       {GeometryTuning::Strategy::kAdaptive, GeometryTuning::Strategy::kRelocate}) {
    GeometryTuning tuning;
    tuning.strategy = strategy;
    for (const int cap : {200, 700}) {
      GeometryOptions options = SmallOptions(60);
      options.max_gaussians = cap;
      options.densify_gradient = 1e-6;
      NullObserver observer;
      const GaussianModel model = TrainGeometryOn(ProblemOf(s, -1),
                                                  InitialGaussians(s.scene),
                                                  options,
                                                  tuning,
                                                  pool,
                                                  none,
                                                  observer,
                                                  CancellationToken());
      EXPECT_LE(model.size(), static_cast<size_t>(cap));
      EXPECT_GT(model.size(), static_cast<size_t>(cap / 2));
    }
  }
}

std::string TrainFor(const ProceduralScene& s,
                     CheckpointStore& store,
                     const CancellationToken& cancel) {
  ThreadPool pool(2);
  NullObserver observer;
  return SerializeGaussians(TrainGeometryOn(ProblemOf(s, 1),
                                            InitialGaussians(s.scene),
                                            SmallOptions(40),
                                            GeometryTuning(),
                                            pool,
                                            store,
                                            observer,
                                            cancel));
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

TEST(TrainGeometryTest, ADamagedCheckpointStartsAfreshWithAWarning) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  SaveThenStop store(0, nullptr);
  store.saved =
      "rubbish that is long enough to hold a digest, or so it seems at first sight, but no";
  ThreadPool pool(1);
  Recorder recorder;
  TrainGeometryOn(ProblemOf(s, -1),
                  InitialGaussians(s.scene),
                  SmallOptions(5),
                  GeometryTuning(),
                  pool,
                  store,
                  recorder,
                  CancellationToken());
  EXPECT_THAT(recorder.warnings, testing::ElementsAre(testing::HasSubstr("starts afresh")));
  EXPECT_EQ(recorder.last_step, 5);
}

struct Refusal {
  ErrorCode code = ErrorCode::kCancelled;
  std::string message;
};

// How training on `problem` fails; a test failure when it does not.
Refusal RefusalOf(const GeometryProblem& problem,
                  const GaussianModel& initial,
                  Recorder& recorder) {
  ThreadPool pool(2);
  NoCheckpoints none;
  try {
    TrainGeometryOn(problem,
                    initial,
                    SmallOptions(50),
                    GeometryTuning(),
                    pool,
                    none,
                    recorder,
                    CancellationToken());
  } catch (const Error& e) {
    return {e.code(), e.what()};
  }
  ADD_FAILURE() << "training succeeded";
  return {};
}

TEST(TrainGeometryTest, RefusesAPictureWithANaNAndNamesItsPlace) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  GeometryProblem problem = ProblemOf(s, -1);
  problem.luminance = [&s](int view) {
    auto picture = std::make_shared<Image>(*s.Luminance(view));
    if (view == 1) picture->At(0, 5, 7) = std::numeric_limits<float>::quiet_NaN();
    return picture;
  };
  Recorder recorder;
  const Refusal refusal = RefusalOf(problem, InitialGaussians(s.scene), recorder);
  EXPECT_EQ(refusal.code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refusal.message, testing::HasSubstr("view 1: the pixel at 7, 5"));
}

// An extent that makes every step overflow, however often the rate is halved.
TEST(TrainGeometryTest, RestoresTheLastGoodStateAndGivesUpAfterSeveralTries) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  GeometryProblem problem = ProblemOf(s, -1);
  problem.extent = 1e60;
  Recorder recorder;
  EXPECT_EQ(RefusalOf(problem, InitialGaussians(s.scene), recorder).code, ErrorCode::kInternal);
  EXPECT_THAT(recorder.warnings, testing::Contains(testing::HasSubstr("not finite")));
  EXPECT_THAT(recorder.errors["restored_non_finite"], testing::SizeIs(testing::Ge(1u)));
}

TEST(TrainGeometryTest, HugeLearningRatesNeverLeaveNonFiniteValues) {
  const ProceduralScene s = MakeRoomCorner(3, 64, 64, 200);
  GeometryOptions options = SmallOptions(80);
  options.learning_rate_scale = 1000.0;
  ThreadPool pool(2);
  NoCheckpoints none;
  Recorder recorder;
  const GaussianModel model = TrainGeometryOn(ProblemOf(s, -1),
                                              InitialGaussians(s.scene),
                                              options,
                                              GeometryTuning(),
                                              pool,
                                              none,
                                              recorder,
                                              CancellationToken());
  for (const float v : model.position) EXPECT_TRUE(std::isfinite(v));
  for (const float v : model.log_scale) EXPECT_TRUE(std::isfinite(v));
}

TEST(TrainGeometryTest, OptionsOutOfRangeAreNamed) {
  GeometryOptions options;
  options.ssim_weight = std::numeric_limits<double>::quiet_NaN();
  try {
    options.Validate();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), testing::HasSubstr("ssim_weight"));
  }
}

TEST(TrainingStateTest, DamagedBytesAreRefusedAtEveryLength) {
  TrainingState state;
  state.parameters = ParameterBlock(12, 5);
  state.moments = {ParameterBlock(12, 5), ParameterBlock(12, 5)};
  state.statistics.Reset(5);
  state.order = {2, 0, 1};
  const std::string bytes = SerializeTrainingState(state, "a");
  TrainingState read;
  EXPECT_TRUE(ParseTrainingState(bytes, "a", read));
  EXPECT_EQ(read.order, state.order);
  EXPECT_FALSE(ParseTrainingState(bytes, "b", read));
  for (size_t n = 0; n < bytes.size(); n += 7) {
    EXPECT_FALSE(ParseTrainingState(bytes.substr(0, n), "a", read));
  }
}

// Walls at their true places, from dense points.
GaussianModel GreyRoom(const ProceduralScene& s) {
  GaussianModel model = InitialGaussians(s.scene);
  for (float& o : model.opacity_logit) o = 2.0f;
  return model;
}

ChromaProblem ChromaProblemOf(const ProceduralScene& s) {
  ChromaProblem problem;
  problem.training = ProblemOf(s, -1).training;
  problem.targets = [&s](int view) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = s.Ab(view);
    return target;
  };
  return problem;
}

double AbError(const GaussianModel& model, const ProceduralScene& s, int view, ThreadPool& pool) {
  const RenderedView r =
      RenderView(model, s.scene.views[view].camera, s.scene.views[view].cam_from_world, pool);
  double sum = 0.0;
  for (int c = 1; c < 3; ++c) {
    for (size_t i = 0; i < r.lab.PlaneSize(); ++i) {
      sum += std::abs(r.lab.Plane(c)[i] - s.lab[view].Plane(c)[i]);
    }
  }
  return sum / (2.0 * static_cast<double>(r.lab.PlaneSize()));
}

TEST(FitChromaTest, ClosedFormIsCloseAndAdamGetsCloser) {
  const ProceduralScene s = MakeRoomCorner(5, 80, 60, 3000);
  ThreadPool pool(2);
  NoCheckpoints none;
  double errors[2];
  for (int run = 0; run < 2; ++run) {
    ChromaOptions options;
    options.iterations = run * 150;
    options.chroma_sh_degree = run;
    Recorder recorder;
    const GaussianModel model = FitChromaOn(
        GreyRoom(s), ChromaProblemOf(s), options, pool, none, recorder, CancellationToken());
    EXPECT_EQ(model.channels, 3);
    EXPECT_EQ(model.chroma_sh_degree, run);
    errors[run] = AbError(model, s, 2, pool);
  }
  EXPECT_LT(errors[0], 8.0);  // the walls' chroma is about 40
  EXPECT_LT(errors[1], 0.7 * errors[0]);
}

TEST(FitChromaTest, UnseenGaussiansTakeTheirNeighboursColours) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 1500);
  GaussianModel geometry = GreyRoom(s);
  // One far behind all cameras, and one on the floor before them but transparent.
  geometry.position.insert(geometry.position.end(), {0.0f, 0.0f, -40.0f});
  geometry.log_scale.insert(geometry.log_scale.end(), {-3.0f, -3.0f, -3.0f});
  geometry.rotation.insert(geometry.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
  geometry.opacity_logit.push_back(3.0f);
  geometry.sh_l.push_back(0.0f);
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver observer;
  ChromaOptions options;
  options.iterations = 20;
  const GaussianModel model =
      FitChromaOn(geometry, ChromaProblemOf(s), options, pool, none, observer, CancellationToken());
  const double c0 = 0.28209479;
  const double a = 255.0 * c0 * model.sh_a.back(), b = 255.0 * c0 * model.sh_b.back();
  EXPECT_LT(std::abs(a), 60.0);
  EXPECT_LT(std::abs(b), 60.0);
  EXPECT_GT(std::hypot(a, b), 10.0);  // some wall's colour, not grey
}

TEST(FitChromaTest, PixelsOfNoWeightDoNotCount) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 1500);
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver observer;
  ChromaProblem problem = ChromaProblemOf(s);
  problem.targets = [&s](int view) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = s.Ab(view);
    target->weight = Image(64, 48, 1, view == 0 ? 0.0f : 1.0f);
    if (view == 0) std::fill(target->ab.data.begin(), target->ab.data.end(), -100.0f);
    return target;
  };
  ChromaOptions options;
  options.iterations = 30;
  const GaussianModel model =
      FitChromaOn(GreyRoom(s), problem, options, pool, none, observer, CancellationToken());
  EXPECT_LT(AbError(model, s, 2, pool), 8.0);
}

TEST(FitChromaTest, ConfidenceIsTheMeanOverThePixelsThatShowTheGaussian) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 1500);
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver observer;
  ChromaOptions options;
  options.iterations = 5;
  ChromaProblem problem = ChromaProblemOf(s);
  GaussianModel geometry = GreyRoom(s);
  geometry.position.insert(geometry.position.end(), {0.0f, 0.0f, -40.0f});  // behind all cameras
  geometry.log_scale.insert(geometry.log_scale.end(), {-3.0f, -3.0f, -3.0f});
  geometry.rotation.insert(geometry.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
  geometry.opacity_logit.push_back(3.0f);
  geometry.sh_l.push_back(0.0f);
  double guessed_weight = 1.0;
  bool last_knows = true;
  problem.targets = [&](int view) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = s.Ab(view);
    target->confidence = Image(64, 48, 1, view % 2 == 0 ? 1.0f : 0.0f);
    if (view % 2 == 1) target->weight = Image(64, 48, 1, static_cast<float>(guessed_weight));
    if (view == 3 && !last_knows) target->confidence = Image();
    return target;
  };
  const auto fit = [&] {
    return FitChromaOn(geometry, problem, options, pool, none, observer, CancellationToken());
  };
  const std::vector<float> even = fit().confidence;
  ASSERT_EQ(even.size(), geometry.size());
  double sum = 0.0;
  for (const float c : even) sum += c;
  EXPECT_NEAR(sum / even.size(), 0.5, 0.1);  // half of the views are sure
  EXPECT_EQ(even.back(), 0.0f) << "nobody saw it";
  // What counts less for the colour counts less for its confidence.
  guessed_weight = 0.0;
  const std::vector<float> sure = fit().confidence;
  double ones = 0.0;
  for (const float c : sure) ones += c > 0.999f;
  EXPECT_GT(ones / sure.size(), 0.8);
  last_knows = false;
  EXPECT_TRUE(fit().confidence.empty());
}

TEST(FitChromaTest, ATargetOfAnotherSizeIsRefused) {
  const ProceduralScene s = MakeRoomCorner(2, 64, 48, 100);
  ThreadPool pool(1);
  NoCheckpoints none;
  NullObserver observer;
  ChromaProblem problem = ChromaProblemOf(s);
  problem.targets = [](int) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(10, 10, 2);
    return target;
  };
  EXPECT_THROW(FitChromaOn(GreyRoom(s), problem, {}, pool, none, observer, CancellationToken()),
               Error);
}

TEST(RelocateTest, CopiesTogetherLookLikeTheOriginal) {
  for (const double opacity : {0.05, 0.5, 0.95}) {
    for (const int copies : {1, 2, 5, 20}) {
      const SplitShare share = ShareOf(opacity, copies);
      EXPECT_NEAR(1.0 - std::pow(1.0 - share.opacity, copies), opacity, 1e-9);
      // Integral over a line of the blended opacity of `copies` equal Gaussians.
      double blended = 0.0, single = 0.0;
      for (double x = -8.0; x < 8.0; x += 0.01) {
        const double one = share.opacity * std::exp(-0.5 * x * x / (share.scale * share.scale));
        blended += 1.0 - std::pow(1.0 - one, copies);
        single += opacity * std::exp(-0.5 * x * x);
      }
      EXPECT_NEAR(blended / single, 1.0, 1e-3) << opacity << " " << copies;
    }
  }
}

}  // namespace
}  // namespace color3d
