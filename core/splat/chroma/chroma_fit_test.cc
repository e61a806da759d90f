// Chroma of a room with known colours, and of systems without a unique solution.
#include "core/splat/chroma/chroma_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/render.h"
#include "tests/support/scenes/chroma_problems.h"
#include "tests/support/scenes/splat_scene.h"

namespace color3d {
namespace {

using chroma_problems::ConstantProblem;
using chroma_problems::Fit;
using chroma_problems::kHeight;
using chroma_problems::kWidth;
using chroma_problems::RandomGaussians;
using chroma_problems::RandomProblem;
using testing_scene::MakeRoomCorner;
using testing_scene::ProceduralScene;

void ExpectFiniteAndBelow(const GaussianModel& model, double most_lab) {
  for (const std::vector<float>* values : {&model.sh_a, &model.sh_b}) {
    for (const float v : *values) {
      ASSERT_TRUE(std::isfinite(v));
      EXPECT_LE(255.0 * kShDc * std::abs(v), most_lab);
    }
  }
}

class FiniteErrors : public NullObserver {
 public:
  void OnError(int64_t, const std::string&, double value) override {
    EXPECT_TRUE(std::isfinite(value));
  }
};

// Walls at their true positions, from dense points.
GaussianModel GrayRoom(const ProceduralScene& s) {
  GaussianModel model = InitialGaussians(s.scene);
  for (float& o : model.opacity_logit) o = 2.0f;
  return model;
}

ChromaProblem RoomProblem(const ProceduralScene& s) {
  ChromaProblem problem;
  for (int i = 0; i < static_cast<int>(s.scene.views.size()); ++i) {
    problem.training.push_back({i, s.scene.views[i].camera, s.scene.views[i].cam_from_world});
  }
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

TEST(FitChromaTest, AdamImprovesOnClosedForm) {
  const ProceduralScene s = MakeRoomCorner(5, 80, 60, 3000);
  ThreadPool pool(2);
  NoCheckpoints none;
  double errors[2];
  for (int run = 0; run < 2; ++run) {
    ChromaOptions options;
    options.iterations = run * 150;
    options.chroma_sh_degree = run;
    FiniteErrors errors_seen;
    const GaussianModel model = FitChroma(
        GrayRoom(s), RoomProblem(s), options, {pool, none, errors_seen, CancellationToken()});
    EXPECT_EQ(model.channels, 3);
    EXPECT_EQ(model.chroma_sh_degree, run);
    errors[run] = AbError(model, s, 2, pool);
  }
  EXPECT_LT(errors[0], 8.0);  // the walls' chroma is about 40
  EXPECT_LT(errors[1], 0.7 * errors[0]);
}

TEST(FitChromaTest, UnseenGaussiansTakeNeighborColors) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 1500);
  GaussianModel geometry = GrayRoom(s);
  // One far behind all cameras, and a transparent one on the floor in front of them.
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
      FitChroma(geometry, RoomProblem(s), options, {pool, none, observer, CancellationToken()});
  const double a = 255.0 * kShDc * model.sh_a.back(), b = 255.0 * kShDc * model.sh_b.back();
  EXPECT_LT(std::abs(a), 60.0);
  EXPECT_LT(std::abs(b), 60.0);
  EXPECT_GT(std::hypot(a, b), 10.0);  // some wall's colour, not grey
}

TEST(FitChromaTest, IgnoresPixelsOfZeroWeight) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 1500);
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver observer;
  ChromaProblem problem = RoomProblem(s);
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
      FitChroma(GrayRoom(s), problem, options, {pool, none, observer, CancellationToken()});
  EXPECT_LT(AbError(model, s, 2, pool), 8.0);
}

TEST(FitChromaTest, ConfidenceIsMeanOverVisiblePixels) {
  const ProceduralScene s = MakeRoomCorner(4, 64, 48, 1500);
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver observer;
  ChromaOptions options;
  options.iterations = 5;
  ChromaProblem problem = RoomProblem(s);
  GaussianModel geometry = GrayRoom(s);
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
    return FitChroma(geometry, problem, options, {pool, none, observer, CancellationToken()});
  };
  const std::vector<float> even = fit().confidence;
  ASSERT_EQ(even.size(), geometry.size());
  double sum = 0.0;
  for (const float c : even) sum += c;
  EXPECT_NEAR(sum / even.size(), 0.5, 0.1);  // half of the views have confidence 1
  EXPECT_EQ(even.back(), 0.0f) << "not seen";
  // Pixels of lower weight count less for the confidence, too.
  guessed_weight = 0.0;
  const std::vector<float> sure = fit().confidence;
  double ones = 0.0;
  for (const float c : sure) ones += c > 0.999f;
  EXPECT_GT(ones / sure.size(), 0.8);
  last_knows = false;
  EXPECT_TRUE(fit().confidence.empty());
}

TEST(FitChromaTest, RejectsTargetOfWrongSize) {
  const ProceduralScene s = MakeRoomCorner(2, 64, 48, 100);
  ThreadPool pool(1);
  NoCheckpoints none;
  NullObserver observer;
  ChromaProblem problem = RoomProblem(s);
  problem.targets = [](int) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(10, 10, 2);
    return target;
  };
  EXPECT_THROW(FitChroma(GrayRoom(s), problem, {}, {pool, none, observer, CancellationToken()}),
               Error);
}

TEST(FitChromaTest, ZeroWeightsGiveNeutralChroma) {
  ChromaProblem problem = RandomProblem(2, 6);
  problem.targets = [](int) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(kWidth, kHeight, 2, 50.0f);
    target->weight = Image(kWidth, kHeight, 1, 0.0f);
    return target;
  };
  ExpectFiniteAndBelow(Fit(RandomGaussians(30, 4), problem, {}), 0.0);
}

TEST(FitChromaTest, NoColoredViewGivesNeutralChroma) {
  ChromaProblem problem = RandomProblem(2, 6);
  problem.targets = [](int) { return nullptr; };
  ExpectFiniteAndBelow(Fit(RandomGaussians(30, 4), problem, {}), 0.0);
}

TEST(FitChromaTest, OnePixelColorsAllGaussiansEqually) {
  const GaussianModel model =
      Fit(RandomGaussians(30, 4), ConstantProblem(1, 40.0f, -20.0f, 1, 1), {});
  ExpectFiniteAndBelow(model, 100.0);  // the pixel is half transparent
}

TEST(FitChromaTest, ConstantTargetGivesConstantColor) {
  for (const int degree : {0, 1}) {
    ChromaOptions options;
    options.chroma_sh_degree = degree;
    GaussianModel geometry = RandomGaussians(1, 4);
    geometry.position = {0.0f, 0.0f, 3.0f};
    geometry.log_scale = {3.0f, 3.0f, -3.0f};  // a wall
    geometry.rotation = {1.0f, 0.0f, 0.0f, 0.0f};
    geometry.opacity_logit = {9.0f};
    const GaussianModel model =
        Fit(geometry, ConstantProblem(2, 40.0f, -20.0f, kWidth, kHeight), options);
    ExpectFiniteAndBelow(model, 60.0);
    EXPECT_NEAR(255.0 * kShDc * model.sh_a[0], 40.4, degree == 0 ? 0.5 : 4.0);  // alpha is 0.99
    EXPECT_NEAR(255.0 * kShDc * model.sh_b[0], -20.2, degree == 0 ? 0.5 : 4.0);
  }
}

TEST(FitChromaTest, IdenticalGaussiansGetSameColor) {
  GaussianModel copies;
  for (int i = 0; i < 20; ++i) {
    copies.position.insert(copies.position.end(), {0.0f, 0.0f, 3.0f});
    copies.log_scale.insert(copies.log_scale.end(), {-1.0f, -1.0f, -1.0f});
    copies.rotation.insert(copies.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
    copies.opacity_logit.push_back(0.0f);
    copies.sh_l.push_back(0.0f);
  }
  ExpectFiniteAndBelow(Fit(copies, ConstantProblem(2, 40.0f, -20.0f, kWidth, kHeight), {}), 128.1);
}

TEST(FitChromaTest, NamesPositionOfNonFiniteValue) {
  for (const bool in_weight : {false, true}) {
    ChromaProblem problem = RandomProblem(2, 6);
    const ChromaTargetSource good = problem.targets;
    problem.targets = [&](int view) {
      auto target = std::make_shared<ChromaTarget>(*good(view));
      if (view == 1) {
        (in_weight ? target->weight : target->ab).At(0, 5, 9) =
            std::numeric_limits<float>::quiet_NaN();
      }
      return target;
    };
    try {
      Fit(RandomGaussians(10, 4), problem, {});
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
      EXPECT_THAT(e.what(), testing::HasSubstr("view 1"));
      EXPECT_THAT(e.what(), testing::HasSubstr("(9, 5)"));
    }
  }
}

TEST(FitChromaTest, TimeLimitEndsBothSolversEarly) {
  for (const auto solver :
       {ChromaOptions::Solver::kConjugateGradients, ChromaOptions::Solver::kAdam}) {
    ChromaOptions options;
    options.solver = solver;
    options.iterations = 100'000;
    options.sweeps = options.rounds = 1000;
    options.objective_tolerance = 0.0;
    options.residual_tolerance = 0.0;
    options.time_limit_seconds = 0.05;
    const auto start = std::chrono::steady_clock::now();
    ExpectFiniteAndBelow(Fit(RandomGaussians(60, 4), RandomProblem(3, 6), options), 300.0);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(3));
  }
}

TEST(FitChromaTest, CanBeCancelled) {
  ThreadPool pool(1);
  NoCheckpoints none;
  NullObserver observer;
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(
      FitChroma(RandomGaussians(5, 4), RandomProblem(1, 6), {}, {pool, none, observer, cancel}),
      Error);
}

}  // namespace
}  // namespace color3d
