// The parts that only core/colorizer sees: model, optimiser, trainer, feature neighbors.
#include <gtest/gtest.h>
#include <torch/torch.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/colorizer/adam.h"
#include "core/colorizer/feature_neighbors.h"
#include "core/colorizer/padding.h"
#include "core/colorizer/personal_model.h"
#include "core/colorizer/recipe.h"
#include "core/colorizer/training_session.h"
#include "core/encoder/random_features.h"

namespace color3d {
namespace {

// A small encoder and decoder: the same code in milliseconds.
ConvNextConfig SmallEncoder() {
  ConvNextConfig config;
  config.dims = {16, 16};
  config.depths = {1, 1};
  return config;
}

class TrainingTest : public testing::Test {
 protected:
  TrainingTest() : encoder_(SmallEncoder(), RandomFeatureWeights(SmallEncoder(), 1), "small") {
    at::set_num_threads(1);
    options_.iterations = 60;
    options_.crop_px = 64;
    Image& luminance = pictures_[0].luminance;
    Image& ab = pictures_[0].ab;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 96; ++x) {
        const bool left = x < 48;
        luminance.At(0, y, x) = 50.0f + 20.0f * std::sin(left ? 0.9f * x : 0.9f * y);
        ab.At(0, y, x) = left ? 40.0f : -40.0f;
        ab.At(1, y, x) = left ? 30.0f : -10.0f;
      }
    }
  }

  torch::Tensor KeyTensor() const {
    return PadToMultiple(TensorFromImage(pictures_[0].luminance), kPadMultiple);
  }
  PersonalModel MakeModel() const {
    Random random(1);
    PersonalModel model(encoder_, recipe_.model, {0.0f, 0.1f}, random);
    model.FreezeStatistics(KeyTensor());
    model.RequireGradients(true);
    return model;
  }

  struct Outcome {
    std::vector<TrainingPoint> curve;
    int rollbacks = 0;
    int64_t iterations = 0;
    bool stopped_early = false;
  };
  Outcome Train(PersonalModel& model,
                CheckpointStore& checkpoints,
                ProgressObserver& progress,
                ThreadPool* helpers = nullptr) const {
    TrainingSession session(pictures_, options_, recipe_, model);
    session.Resume(checkpoints.Load(), progress);
    while (!session.Finished()) {
      session.Step(progress, helpers);
      if (session.AtCheckpoint() && checkpoints.WantsSave()) {
        checkpoints.Save(session.Checkpoint());
      }
    }
    session.Conclude(progress);
    return {session.curve(), session.rollbacks(), session.iteration(), session.stopped_early()};
  }
  static void ExpectSameParameters(const PersonalModel& x, const PersonalModel& y) {
    for (size_t i = 0; i < x.parameters().size(); ++i) {
      EXPECT_TRUE(torch::equal(x.parameters()[i].second, y.parameters()[i].second))
          << x.parameters()[i].first;
    }
  }

  ConvNext encoder_;
  TrainingRecipe recipe_;
  ColorizerOptions options_;
  std::vector<TrainingPicture> pictures_{{"key", Image(96, 64, 1), Image(96, 64, 2)}};
};

struct Warnings : NullObserver {
  void OnWarning(const std::string& message) override { messages.push_back(message); }
  void OnError(int64_t, const std::string& name, double value) override {
    EXPECT_TRUE(std::isfinite(value)) << name;
    if (name == "train_l1_ab") train.push_back(value);
    if (name == "validation_delta_e00") validation.push_back(value);
  }
  std::vector<std::string> messages;
  std::vector<double> train;
  std::vector<double> validation;
};

// Saves once, then fails the next save as if the worker had died.
struct OneCheckpoint : CheckpointStore {
  std::optional<std::string> Load() override { return loaded; }
  bool WantsSave() override { return wants_save; }
  void Save(const std::string& state) override {
    saved = state;
    if (die_after_save) throw Error(ErrorCode::kAborted, "the worker died");
  }
  std::optional<std::string> loaded;
  std::string saved;
  bool wants_save = true;
  bool die_after_save = false;
};

TEST_F(TrainingTest, AdaptersStartAsTheFrozenEncoderExactly) {
  recipe_.model.adapter_stages = 8;
  PersonalModel model = MakeModel();
  torch::NoGradGuard no_grad;
  const auto adapted = model.Taps(KeyTensor());
  const auto frozen = encoder_.Taps(encoder_.Input(KeyTensor()));
  for (size_t i = 0; i < frozen.size(); ++i) EXPECT_TRUE(torch::equal(adapted[i], frozen[i]));
}

TEST_F(TrainingTest, AdaptersLearnWhileTheEncoderStaysFrozen) {
  recipe_.model.adapter_stages = 8;
  PersonalModel model = MakeModel();
  const auto before = encoder_.Taps(encoder_.Input(KeyTensor()));
  NoCheckpoints checkpoints;
  NullObserver progress;
  options_.iterations = 3;
  Train(model, checkpoints, progress);
  torch::NoGradGuard no_grad;
  const auto after = encoder_.Taps(encoder_.Input(KeyTensor()));
  const auto adapted = model.Taps(KeyTensor());
  EXPECT_TRUE(torch::equal(before[1], after[1]));
  EXPECT_FALSE(torch::equal(adapted[1], after[1]));
}

TEST_F(TrainingTest, FrozenStatisticsAreTheKeyViews) {
  PersonalModel model = MakeModel();
  torch::NoGradGuard no_grad;
  // The prediction for a part of the picture does not depend on the rest of it: with instance norm
  // it would. Compared away from the border of the crop.
  const torch::Tensor whole = torch::rand({1, 1, 64, 128}) * 100.0;
  torch::Tensor other = whole.clone();
  other.slice(3, 96, 128).fill_(5.0);
  const torch::Tensor x = model.Forward(whole).slice(3, 0, 20);
  const torch::Tensor y = model.Forward(other).slice(3, 0, 20);
  EXPECT_LT((x - y).abs().max().item<double>(), 1e-6);
  recipe_.model.instance_norm = true;
  PersonalModel paper = MakeModel();
  const torch::Tensor u = paper.Forward(whole).slice(3, 0, 20);
  const torch::Tensor v = paper.Forward(other).slice(3, 0, 20);
  EXPECT_GT((u - v).abs().max().item<double>(), 1e-5);
}

TEST_F(TrainingTest, LossFalls) {
  PersonalModel model = MakeModel();
  NoCheckpoints checkpoints;
  Warnings progress;
  options_.iterations = 150;
  const Outcome trainer = Train(model, checkpoints, progress);
  ASSERT_GE(progress.validation.size(), 10u);
  EXPECT_LT(progress.validation.back(), 0.5 * progress.validation.front());
  EXPECT_EQ(trainer.curve.back().iteration, 150);
  EXPECT_TRUE(progress.messages.empty());
}

// A second picture that says that everything is green.
TrainingPicture Green(const TrainingPicture& key) {
  TrainingPicture green = key;
  green.name = "green";
  for (size_t i = 0; i < green.ab.PlaneSize(); ++i) {
    green.ab.Plane(0)[i] = -60.0f;
    green.ab.Plane(1)[i] = 60.0f;
  }
  return green;
}

TEST_F(TrainingTest, PicturesOfShareOrWeightZeroTeachNothing) {
  NoCheckpoints checkpoints;
  Warnings alone, shared, weighted;
  options_.iterations = 150;
  PersonalModel model = MakeModel();
  Train(model, checkpoints, alone);
  // Drawing among several takes a random number more: not the same bytes, but the same quality.
  TrainingPicture green = Green(pictures_[0]);
  green.share = 0.0;
  pictures_.push_back(green);
  PersonalModel second = MakeModel();
  Train(second, checkpoints, shared);
  EXPECT_LT(shared.validation.back(), 2.0 * alone.validation.back());
  pictures_[1].share = 1.0;
  pictures_[1].weight = Image(96, 64, 1);
  PersonalModel third = MakeModel();
  Train(third, checkpoints, weighted);
  EXPECT_LT(weighted.validation.back(), 0.6 * weighted.validation.front());
}

TEST_F(TrainingTest, PicturesAreDrawnByTheirShare) {
  NoCheckpoints checkpoints;
  Warnings progress;
  options_.iterations = 150;
  pictures_.push_back(Green(pictures_[0]));
  pictures_[1].share = 50.0;
  PersonalModel model = MakeModel();
  Train(model, checkpoints, progress);
  // It has learnt green, so that the key view's own held-out views are wrong.
  EXPECT_GT(progress.validation.back(), 0.8 * progress.validation.front());
}

TEST_F(TrainingTest, ConsistencyAndPaperRecipesTrain) {
  for (bool paper : {false, true}) {
    options_.recipe = paper ? ColorizerOptions::Recipe::kPaper : ColorizerOptions::Recipe::kOurs;
    options_.consistency_weight = 1.0;
    options_.iterations = 4;
    recipe_ = RecipeFor(options_);
    PersonalModel model = MakeModel();
    NoCheckpoints checkpoints;
    Warnings progress;
    Train(model, checkpoints, progress);
    EXPECT_FALSE(progress.train.empty());
  }
}

TEST_F(TrainingTest, ResumedTrainingEndsAsUninterruptedTraining) {
  NullObserver progress;
  PersonalModel straight = MakeModel();
  NoCheckpoints none;
  const Outcome straight_trainer = Train(straight, none, progress);

  OneCheckpoint checkpoints;
  checkpoints.die_after_save = true;
  PersonalModel first = MakeModel();
  EXPECT_THROW(Train(first, checkpoints, progress), Error);
  ASSERT_FALSE(checkpoints.saved.empty());
  checkpoints.loaded = checkpoints.saved;
  checkpoints.wants_save = false;
  PersonalModel second = MakeModel();
  const Outcome resumed = Train(second, checkpoints, progress);
  ExpectSameParameters(straight, second);
  ASSERT_EQ(resumed.curve.size(), straight_trainer.curve.size());
  for (size_t i = 0; i < resumed.curve.size(); ++i) {
    EXPECT_EQ(resumed.curve[i].iteration, straight_trainer.curve[i].iteration);
    EXPECT_EQ(resumed.curve[i].train_l1_ab, straight_trainer.curve[i].train_l1_ab);
  }
}

TEST_F(TrainingTest, AHelpingThreadChangesNothing) {
  options_.iterations = 30;
  NoCheckpoints none;
  NullObserver progress;
  PersonalModel alone = MakeModel();
  Train(alone, none, progress);
  PersonalModel helped = MakeModel();
  ThreadPool helpers(2);
  Train(helped, none, progress, &helpers);
  ExpectSameParameters(alone, helped);
}

TEST_F(TrainingTest, StopsEarlyWhenTheCurveIsFlatAlsoAfterResuming) {
  options_.iterations = 400;
  options_.least_improvement = 0.5;
  OneCheckpoint checkpoints;
  NullObserver progress;
  PersonalModel model = MakeModel();
  const Outcome outcome = Train(model, checkpoints, progress);
  EXPECT_TRUE(outcome.stopped_early);
  EXPECT_LT(outcome.iterations, 400);
  EXPECT_GE(outcome.curve.size(), 7u);
  // The last checkpoint lies a few iterations before the stop.
  checkpoints.loaded = checkpoints.saved;
  PersonalModel resumed = MakeModel();
  const Outcome again = Train(resumed, checkpoints, progress);
  EXPECT_TRUE(again.stopped_early);
  EXPECT_EQ(again.iterations, outcome.iterations);
  ExpectSameParameters(model, resumed);
}

TEST(EarlyStopTest, ComparesMeansOfThreeOverAWindowOfFour) {
  EarlyStop falling({.least_improvement = 0.01});
  double error = 10.0;
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(falling.Add(error *= 0.99)) << i;
  EarlyStop flat({.least_improvement = 0.01});
  for (int i = 0; i < 6; ++i) EXPECT_FALSE(flat.Add(5.0)) << i;
  EXPECT_TRUE(flat.Add(5.0));
  EarlyStop off({.least_improvement = 0.0});
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(off.Add(5.0 + i));
}

TEST_F(TrainingTest, TheAverageIsDeliveredWhenItIsBetter) {
  NoCheckpoints none;
  Warnings averaged, plain;
  options_.iterations = 60;
  recipe_.last_learning_rate = recipe_.first_learning_rate;  // the last step is a noisy one
  options_.average_decay = 0.0;
  PersonalModel last = MakeModel();
  Train(last, none, plain);
  options_.average_decay = 0.9;
  PersonalModel mean = MakeModel();
  Train(mean, none, averaged);
  EXPECT_FALSE(torch::equal(last.parameters()[0].second, mean.parameters()[0].second));
  EXPECT_LT(averaged.validation.back(), 1.1 * plain.validation.back());
}

TEST_F(TrainingTest, Bfloat16LearnsAsWell) {
  NoCheckpoints none;
  Warnings single, half;
  options_.iterations = 100;
  PersonalModel first = MakeModel();
  Train(first, none, single);
  recipe_.model.half_products = true;
  PersonalModel second = MakeModel();
  Train(second, none, half);
  EXPECT_LT(half.validation.back(), 1.5 * single.validation.back() + 1.0);
  EXPECT_EQ(second.parameters()[0].second.scalar_type(), torch::kFloat32);
}

TEST_F(TrainingTest, AForeignOrDamagedCheckpointIsReportedAndIgnored) {
  OneCheckpoint checkpoints;
  NullObserver quiet;
  options_.iterations = 25;
  PersonalModel first = MakeModel();
  Train(first, checkpoints, quiet);
  ASSERT_FALSE(checkpoints.saved.empty());
  options_.seed = 7;
  std::string damaged = checkpoints.saved;
  damaged[damaged.size() / 2] ^= 1;
  for (const std::string& state : {checkpoints.saved, damaged, std::string("junk")}) {
    checkpoints.loaded = state;
    Warnings progress;
    PersonalModel model = MakeModel();
    const Outcome trainer = Train(model, checkpoints, progress);
    EXPECT_EQ(progress.messages.size(), 1u);
    EXPECT_EQ(trainer.curve.front().iteration, 1);
  }
}

TEST_F(TrainingTest, DivergenceRollsBackWarnsAndEndsFinite) {
  recipe_.first_learning_rate = 1.0;
  recipe_.warmup_iterations = 0;
  options_.iterations = 80;
  PersonalModel model = MakeModel();
  NoCheckpoints checkpoints;
  Warnings progress;
  const Outcome trainer = Train(model, checkpoints, progress);
  EXPECT_GT(trainer.rollbacks, 0);
  EXPECT_EQ(progress.messages.size(), static_cast<size_t>(trainer.rollbacks));
  for (const auto& [name, tensor] : model.parameters()) {
    EXPECT_TRUE(tensor.isfinite().all().item<bool>()) << name;
  }
}

TEST_F(TrainingTest, TimeLimitShortensTheSchedule) {
  options_.iterations = 100000;
  options_.time_limit_seconds = 0.5;
  PersonalModel model = MakeModel();
  NoCheckpoints checkpoints;
  NullObserver progress;
  const Outcome trainer = Train(model, checkpoints, progress);
  EXPECT_LT(trainer.curve.back().iteration, 100000);
  EXPECT_GE(trainer.curve.back().seconds, 0.5);
  EXPECT_LT(trainer.curve.back().seconds, 10.0);
}

TEST(AdamTest, AgreesWithTheFormulaInFloat64) {
  torch::Tensor x = torch::tensor({3.0f, -2.0f}).requires_grad_(true);
  Adam adam({{"x", x}});
  double value[2] = {3.0, -2.0}, m[2] = {}, v[2] = {};
  for (int step = 1; step <= 20; ++step) {
    x.square().sum().backward();
    double gradient[2] = {2.0 * value[0], 2.0 * value[1]};
    const double norm = std::hypot(gradient[0], gradient[1]);
    EXPECT_NEAR(adam.Step(0.1, 1.5), norm, 1e-4);
    const double clip = norm > 1.5 ? 1.5 / norm : 1.0;
    for (int i = 0; i < 2; ++i) {
      m[i] = 0.9 * m[i] + 0.1 * gradient[i] * clip;
      v[i] = 0.999 * v[i] + 0.001 * gradient[i] * gradient[i] * clip * clip;
      value[i] -= 0.1 * (m[i] / (1.0 - std::pow(0.9, step))) /
                  (std::sqrt(v[i] / (1.0 - std::pow(0.999, step))) + 1e-8);
      EXPECT_NEAR(x[i].item<double>(), value[i], 1e-4);
    }
  }
}

TEST(AdamTest, ANonFiniteGradientChangesNothing) {
  torch::Tensor x = torch::tensor({3.0f}).requires_grad_(true);
  Adam adam({{"x", x}});
  (x * std::numeric_limits<float>::quiet_NaN()).sum().backward();
  EXPECT_FALSE(std::isfinite(adam.Step(0.1, 1.0)));
  EXPECT_EQ(x.item<float>(), 3.0f);
  EXPECT_EQ(adam.steps(), 0);
}

TEST_F(TrainingTest, NeighborsOfTheKeyViewHaveItsColours) {
  FeatureNeighborsOptions options;
  options.tap_weights = {1.0, 1.0, 1.0, 1.0, 1.0};
  const FeatureNeighbors neighbors(encoder_, pictures_, options, Random(1), {});
  const torch::Tensor l = KeyTensor();
  const NeighborColors found =
      neighbors.Lookup(encoder_.Taps(encoder_.Input(l)), l, pictures_[0].luminance.height);
  ASSERT_EQ(found.ab.sizes(), (std::vector<int64_t>{2, 16, 24}));
  // Away from the border between the two colours.
  EXPECT_NEAR(found.ab[0].slice(1, 2, 9).mean().item<double>(), 40.0, 2.0);
  EXPECT_NEAR(found.ab[0].slice(1, 15, 22).mean().item<double>(), -40.0, 2.0);
  EXPECT_LT(found.distance.mean().item<double>(), 0.1);
}

TEST_F(TrainingTest, NeighborsAgreeWithTheDefinitionInFloat64) {
  FeatureNeighborsOptions options;
  options.tap_weights = {1.0, 1.0, 1.0, 1.0, 1.0};
  options.bank_size = 300;
  const FeatureNeighbors neighbors(encoder_, pictures_, options, Random(1), {});
  const torch::Tensor bank = neighbors.State().at("bank").to(torch::kFloat64);
  const torch::Tensor colors = neighbors.State().at("colors").to(torch::kFloat64);
  const FeatureNeighbors::Matches matches =
      neighbors.LookupFeatures(neighbors.State().at("bank") + 0.05f);
  const torch::Tensor answer = matches.ab.to(torch::kFloat64);
  for (int64_t q = 0; q < 5; ++q) {
    const torch::Tensor d = (bank - (bank[q] + 0.05)).square().sum(1);
    const torch::Tensor best = d.min();
    const torch::Tensor weight =
        torch::exp(-(d - best) / (options.temperature * (best + options.distance_floor)));
    const torch::Tensor expected = torch::mv(colors.t(), weight) / weight.sum();
    EXPECT_LT((answer[q] - expected).abs().max().item<double>(), 1e-2);
    const double variance =
        (torch::mv((colors - expected).square().t(), weight) / weight.sum()).sum().item<double>();
    EXPECT_NEAR(matches.variance[q].item<double>(), variance, 1e-2 * (1.0 + variance));
  }
}

TEST(PaddingTest, ReflectsOrReplicatesToMultiples) {
  const torch::Tensor x = torch::arange(12, torch::kFloat32).view({1, 1, 3, 4});
  const torch::Tensor padded = PadToMultiple(x, 5);
  EXPECT_EQ(padded.sizes(), (std::vector<int64_t>{1, 1, 5, 5}));
  EXPECT_EQ(padded[0][0][0][4].item<float>(), 2.0f);
  EXPECT_EQ(padded[0][0][3][0].item<float>(), 4.0f);
  EXPECT_TRUE(torch::equal(PadToMultiple(x, 1), x));
  EXPECT_EQ(PadToMultiple(torch::ones({1, 1, 1, 1}), 32).sum().item<float>(), 1024.0f);
}

}  // namespace
}  // namespace color3d
