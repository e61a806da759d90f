// The chroma solvers against float64, and systems that have no unique answer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/splat/chroma/chroma_parameters.h"
#include "core/splat/chroma/chroma_system.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/raster/pipeline.h"
#include "tests/reference/splat.h"
#include "tests/support/instruction_set_testing.h"

namespace color3d {
namespace {

constexpr int kWidth = 37, kHeight = 26;

PosedCamera CameraAt(int view, double shift, int width = kWidth, int height = kHeight) {
  PosedCamera posed;
  posed.view = view;
  posed.camera.width = width;
  posed.camera.height = height;
  posed.camera.fx = posed.camera.fy = 30.0;
  posed.camera.cx = 0.5 * width;
  posed.camera.cy = 0.5 * height;
  posed.cam_from_world.translation = Eigen::Vector3d(shift, -0.1 * shift, 0.0);
  return posed;
}

GaussianModel RandomGaussians(int count, uint64_t seed) {
  Random random(seed);
  GaussianModel model;
  for (int i = 0; i < count; ++i) {
    const double z = random.NextUniform(2.0, 5.0);
    model.position.insert(model.position.end(),
                          {static_cast<float>(random.NextUniform(-0.5, 0.5) * z),
                           static_cast<float>(random.NextUniform(-0.4, 0.4) * z),
                           static_cast<float>(z)});
    for (int k = 0; k < 3; ++k) {
      model.log_scale.push_back(static_cast<float>(random.NextUniform(-2.0, -0.7)));
    }
    for (int k = 0; k < 4; ++k) {
      model.rotation.push_back(static_cast<float>(random.NextUniform(-1.0, 1.0)));
    }
    model.opacity_logit.push_back(static_cast<float>(random.NextUniform(-1.0, 3.0)));
    model.sh_l.push_back(0.0f);
  }
  return model;
}

ChromaProblem RandomProblem(int views, uint64_t seed) {
  ChromaProblem problem;
  for (int v = 0; v < views; ++v) problem.training.push_back(CameraAt(v, 0.3 * v - 0.4));
  problem.targets = [seed](int view) {
    Random random(seed, static_cast<uint64_t>(view));
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(kWidth, kHeight, 2);
    target->weight = Image(kWidth, kHeight, 1);
    for (float& v : target->ab.data) v = static_cast<float>(random.NextUniform(-60.0, 60.0));
    for (float& v : target->weight.data) v = static_cast<float>(random.NextUniform(0.0, 1.0));
    return target;
  };
  return problem;
}

ChromaProblem ConstantProblem(int views, float a, float b, int width, int height) {
  ChromaProblem problem;
  for (int v = 0; v < views; ++v) problem.training.push_back(CameraAt(v, 0.2 * v, width, height));
  problem.targets = [=](int) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(width, height, 2, a);
    std::fill_n(target->ab.Plane(1), target->ab.PlaneSize(), b);
    return target;
  };
  return problem;
}

GaussianModel Fit(const GaussianModel& geometry,
                  const ChromaProblem& problem,
                  const ChromaOptions& options,
                  int threads = 2) {
  ThreadPool pool(threads);
  NoCheckpoints none;
  NullObserver observer;
  return FitChromaOn(geometry, problem, options, pool, none, observer, CancellationToken());
}

void ExpectFiniteAndBelow(const GaussianModel& model, double most_lab) {
  for (const std::vector<float>* values : {&model.sh_a, &model.sh_b}) {
    for (const float v : *values) {
      ASSERT_TRUE(std::isfinite(v));
      EXPECT_LE(255.0 * kShDc * std::abs(v), most_lab);
    }
  }
}

// W of one view by the float64 renderer: a picture per coefficient, which is set to 1 alone.
Eigen::MatrixXd DenseWeights(const GaussianModel& geometry, int degree, const PosedCamera& view) {
  const ChromaParameters p = ChromaParameters::From(geometry, degree);
  const int n = p.coefficients();
  ColorSpec color;
  color.channel[0] = {kColorRow, n, 0.0f, false};
  ReferenceParameters reference = ReferenceParameters::From(p.block);
  Eigen::MatrixXd w(view.camera.width * view.camera.height, n * p.block.count());
  for (int64_t i = 0; i < p.block.count(); ++i) {
    for (int k = 0; k < n; ++k) {
      reference.At(kColorRow + k, static_cast<int>(i)) = 1.0;
      const ReferenceImage image = ReferenceRender(
          reference, color, MakeRasterCamera(view.camera, view.cam_from_world), {0.0});
      reference.At(kColorRow + k, static_cast<int>(i)) = 0.0;
      for (size_t j = 0; j < image.color[0].size(); ++j) {
        w(static_cast<int>(j), i * n + k) = image.color[0][j];
      }
    }
  }
  return w;
}

// The regularised least squares of one channel by a dense Cholesky factorisation.
Eigen::VectorXd DenseSolution(const GaussianModel& geometry,
                              const ChromaProblem& problem,
                              const ChromaOptions& options,
                              int channel,
                              const Eigen::VectorXd& first) {
  const int n = options.chroma_sh_degree == 0 ? 1 : 4;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(first.size(), first.size());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(first.size());
  for (const PosedCamera& view : problem.training) {
    const Eigen::MatrixXd w = DenseWeights(geometry, options.chroma_sh_degree, view);
    const auto target = problem.targets(view.view);
    Eigen::VectorXd t(w.rows()), d(w.rows());
    for (int j = 0; j < w.rows(); ++j) {
      t[j] = target->ab.Plane(channel)[j] / 255.0;
      d[j] = target->weight.data[j];
    }
    normal += w.transpose() * d.asDiagonal() * w;
    right += w.transpose() * d.asDiagonal() * t;
  }
  for (int j = 0; j < first.size(); ++j) {
    const double pull =
        options.tikhonov * kShDc * kShDc * (j % n == 0 ? 1.0 : options.tikhonov_rest);
    normal(j, j) += pull;
    right[j] += pull * first[j];
  }
  return normal.ldlt().solve(right);
}

class ChromaSolverTest : public testing::TestWithParam<int> {};

TEST_P(ChromaSolverTest, LeastSquaresAgreesWithADenseFactorisation) {
  const GaussianModel geometry = RandomGaussians(40, 3);
  const ChromaProblem problem = RandomProblem(3, 5);
  ChromaOptions options;
  options.chroma_sh_degree = GetParam();
  options.iterations = 0;
  const GaussianModel closed = Fit(geometry, problem, options);
  options.iterations = 1000;
  options.robust = false;
  options.sweeps = 0;
  options.rounds = 3;
  options.steps_per_round = 300;
  options.residual_tolerance = 1e-9;
  options.objective_tolerance = 0.0;
  options.tikhonov = 1.0;
  const GaussianModel model = Fit(geometry, problem, options);
  for (int c = 0; c < 2; ++c) {
    const auto vector = [&](const GaussianModel& m) -> Eigen::VectorXd {
      const std::vector<float>& v = c == 0 ? m.sh_a : m.sh_b;
      return Eigen::Map<const Eigen::VectorXf>(v.data(), static_cast<int>(v.size())).cast<double>();
    };
    const Eigen::VectorXd expected = DenseSolution(geometry, problem, options, c, vector(closed));
    EXPECT_LT((vector(model) - expected).norm(), 1e-3 * expected.norm());
    EXPECT_GT((vector(closed) - expected).norm(), 0.05 * expected.norm());  // the check can fail
  }
}

INSTANTIATE_TEST_SUITE_P(Degrees, ChromaSolverTest, testing::Values(0, 1));

using TileWeightsTest = InstructionSetTest<int>;

TEST_P(TileWeightsTest, ProductsAgreeWithTheRasterizerAndWithEachOther) {
  const GaussianModel geometry = RandomGaussians(TestCase(), 7);
  ChromaParameters p = ChromaParameters::From(geometry, 0);
  Random random(2);
  AlignedFloats value(2 * p.block.count());
  for (int64_t i = 0; i < p.block.count(); ++i) {
    for (int c = 0; c < 2; ++c) {
      value[2 * i + c] = static_cast<float>(random.NextUniform(-0.3, 0.3));
      p.Row(c, 0)[i] = value[2 * i + c] / kShDc;
    }
  }
  p.color.channel[0].base = p.color.channel[1].base = 0.0f;
  const PosedCamera view = CameraAt(0, 0.1);
  const RasterCamera camera = MakeRasterCamera(view.camera, view.cam_from_world);
  ThreadPool pool(1);
  SplatPipeline pipeline;
  const float background[2] = {0.0f, 0.0f};
  pipeline.Forward(p.block, p.color, camera, background, false, pool);
  SplatBuffer splats;
  TileBinner binner;
  TileLists lists;
  ProjectSplats(p.block, p.color, false, camera, pool, splats);
  binner.Bin(splats, camera.width, camera.height, pool, lists);
  for (int tile = 0; tile < lists.tile_count(); ++tile) {
    TileWeights w;
    BuildTileWeights(splats, lists, tile, camera.width, camera.height, w);
    std::vector<float> picture(2 * kTilePixels), other(2 * kTilePixels);
    TileForward(w, value.data(), picture.data());
    for (float& v : other) v = static_cast<float>(random.NextUniform(-1.0, 1.0));
    std::vector<float> sum(value.size(), 0.0f);
    TileAdjoint(w, other.data(), sum.data());
    double forward = 0.0, adjoint = 0.0, size = 0.0;
    for (int i = 0; i < 2 * kTilePixels; ++i) {
      forward += static_cast<double>(picture[i]) * other[i];
      size += std::abs(static_cast<double>(picture[i]) * other[i]);
      const int b = i / (2 * kBlockPixels), c = i / kBlockPixels % 2, lane = i % kBlockPixels;
      const int x = tile % lists.tiles_x * kTileSide + PixelX(b, lane);
      const int y = tile / lists.tiles_x * kTileSide + PixelY(b, lane);
      const bool inside = x < kWidth && y < kHeight;
      EXPECT_NEAR(picture[i], inside ? pipeline.color().Row(c, y)[x] : 0.0f, 2e-3);
    }
    for (size_t i = 0; i < value.size(); ++i) adjoint += static_cast<double>(value[i]) * sum[i];
    EXPECT_NEAR(forward, adjoint, 1e-6 * size + 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels,
                         TileWeightsTest,
                         testing::Combine(testing::Values(1, 60, 800), EachInstructionSet()));

TEST(FitChromaTest, ConjugateGradientsBeatTheClosedFormAndAFewStepsOfAdam) {
  const GaussianModel geometry = RandomGaussians(60, 4);
  const ChromaProblem problem = RandomProblem(3, 6);
  std::vector<double> l1;
  for (const int run : {0, 1, 2}) {
    ChromaOptions options;
    options.iterations = run == 0 ? 0 : 60;
    if (run == 2) options.solver = ChromaOptions::Solver::kAdam;
    const GaussianModel model = Fit(geometry, problem, options);
    double sum = 0.0, total = 0.0;
    for (const PosedCamera& view : problem.training) {
      const Eigen::MatrixXd w = DenseWeights(geometry, 0, view);
      const auto target = problem.targets(view.view);
      const Eigen::VectorXd a =
          w * Eigen::Map<const Eigen::VectorXf>(model.sh_a.data(), w.cols()).cast<double>();
      for (int j = 0; j < w.rows(); ++j) {
        sum += target->weight.data[j] * std::abs(255.0 * a[j] - target->ab.data[j]);
        total += target->weight.data[j];
      }
    }
    l1.push_back(sum / total);
  }
  EXPECT_LT(l1[1], l1[0]);
  EXPECT_LE(l1[1], l1[2] * 1.001);
}

TEST(FitChromaTest, ViewsBeyondTheMemoryBudgetGiveTheSameBytes) {
  const GaussianModel geometry = RandomGaussians(60, 4);
  const ChromaProblem problem = RandomProblem(3, 6);
  ChromaOptions options;
  options.chroma_sh_degree = 1;
  const GaussianModel kept = Fit(geometry, problem, options);
  EXPECT_EQ(Fit(geometry, problem, options).sh_a, kept.sh_a);
  options.memory_budget_bytes = 0;
  EXPECT_EQ(Fit(geometry, problem, options).sh_a, kept.sh_a);
}

TEST(FitChromaTest, NoWeightAnywhereLeavesNeutralChroma) {
  ChromaProblem problem = RandomProblem(2, 6);
  problem.targets = [](int) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(kWidth, kHeight, 2, 50.0f);
    target->weight = Image(kWidth, kHeight, 1, 0.0f);
    return target;
  };
  ExpectFiniteAndBelow(Fit(RandomGaussians(30, 4), problem, {}), 0.0);
}

TEST(FitChromaTest, NoViewHasColours) {
  ChromaProblem problem = RandomProblem(2, 6);
  problem.targets = [](int) { return nullptr; };
  ExpectFiniteAndBelow(Fit(RandomGaussians(30, 4), problem, {}), 0.0);
}

TEST(FitChromaTest, OnePixelColoursAllGaussiansAlike) {
  const GaussianModel model =
      Fit(RandomGaussians(30, 4), ConstantProblem(1, 40.0f, -20.0f, 1, 1), {});
  ExpectFiniteAndBelow(model, 100.0);  // the pixel is half transparent
}

TEST(FitChromaTest, AConstantTargetGivesItsColourWhereTheSceneIsSolid) {
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

TEST(FitChromaTest, CopiesOfOneGaussianShareItsColour) {
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

TEST(FitChromaTest, ValuesThatAreNotFiniteAreRefusedWithTheirPlace) {
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

class LastSave : public CheckpointStore {
 public:
  explicit LastSave(int stop_after) : stop_after_(stop_after) {}
  std::optional<std::string> Load() override { return state_; }
  bool WantsSave() override { return true; }
  void Save(const std::string& state) override {
    state_ = state;
    if (--stop_after_ == 0) throw Error(ErrorCode::kAborted, "stopped");
  }

 private:
  int stop_after_;
  std::optional<std::string> state_;
};

TEST(FitChromaTest, GoesOnFromACheckpointWithTheSameBytes) {
  const GaussianModel geometry = RandomGaussians(60, 4);
  const ChromaProblem problem = RandomProblem(3, 6);
  for (const auto solver :
       {ChromaOptions::Solver::kConjugateGradients, ChromaOptions::Solver::kAdam}) {
    ChromaOptions options;
    options.solver = solver;
    options.iterations = 40;
    options.sweeps = 6;
    options.objective_tolerance = 0.0;
    const GaussianModel whole = Fit(geometry, problem, options);
    for (const int stop_after : {1, 5, 7}) {
      ThreadPool pool(2);
      LastSave store(stop_after);
      NullObserver observer;
      CancellationToken cancel;
      EXPECT_THROW(FitChromaOn(geometry, problem, options, pool, store, observer, cancel), Error);
      EXPECT_EQ(FitChromaOn(geometry, problem, options, pool, store, observer, cancel).sh_b,
                whole.sh_b);
    }
  }
}

TEST(FitChromaTest, ATimeLimitEndsBothSolversEarlyWithSoundChroma) {
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

TEST(FitChromaTest, CancellationIsHeard) {
  ThreadPool pool(1);
  NoCheckpoints none;
  NullObserver observer;
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(
      FitChromaOn(RandomGaussians(5, 4), RandomProblem(1, 6), {}, pool, none, observer, cancel),
      Error);
}

}  // namespace
}  // namespace color3d
