#include "core/colorizer/training/training_session.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/colorizer/training/view_change.h"
#include "tests/support/networks/small_colorizer.h"

namespace color3d {
namespace {

class TrainingTest : public SmallColorizerTest {
 protected:
  TrainingTest() {
    options_.iterations = 60;
    options_.crop_px = 64;
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
    session.KeepBetterParameters(progress);
    return {session.curve(), session.rollbacks(), session.iteration(), session.stopped_early()};
  }
  static void ExpectSameParameters(const PersonalModel& x, const PersonalModel& y) {
    for (size_t i = 0; i < x.parameters().size(); ++i) {
      EXPECT_TRUE(torch::equal(x.parameters()[i].second, y.parameters()[i].second))
          << x.parameters()[i].first;
    }
  }

  ColorizerOptions options_;
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

// Saves once, then throws at the next save to simulate the death of the worker.
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

TEST_F(TrainingTest, TrainsAdaptersAndKeepsEncoderFrozen) {
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

TEST_F(TrainingTest, ReducesLoss) {
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

// A second picture, all green.
TrainingPicture Green(const TrainingPicture& key) {
  TrainingPicture green = key;
  green.name = "green";
  for (size_t i = 0; i < green.ab.PlaneSize(); ++i) {
    green.ab.Plane(0)[i] = -60.0f;
    green.ab.Plane(1)[i] = 60.0f;
  }
  return green;
}

TEST_F(TrainingTest, IgnoresPicturesOfZeroShareOrWeight) {
  NoCheckpoints checkpoints;
  Warnings alone, shared, weighted;
  options_.iterations = 150;
  PersonalModel model = MakeModel();
  Train(model, checkpoints, alone);
  // Drawing among several pictures uses another random number: other bytes, but the same quality.
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

TEST_F(TrainingTest, DrawsPicturesByShare) {
  NoCheckpoints checkpoints;
  Warnings progress;
  options_.iterations = 150;
  pictures_.push_back(Green(pictures_[0]));
  pictures_[1].share = 50.0;
  PersonalModel model = MakeModel();
  Train(model, checkpoints, progress);
  // Training on green leaves the error of the held-out views as it is.
  EXPECT_GT(progress.validation.back(), 0.8 * progress.validation.front());
}

TEST_F(TrainingTest, ConsistencyAndPaperRecipesTrain) {
  for (bool paper : {false, true}) {
    options_.recipe = paper ? ColorizerOptions::Recipe::kPaper : ColorizerOptions::Recipe::kColor3d;
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

// Mean variance of the answers to changes of the key view, mapped back.
double VarianceOfAnswers(const PersonalModel& model, const torch::Tensor& key) {
  torch::NoGradGuard no_grad;
  Random random(9);
  std::vector<torch::Tensor> answers;
  for (int i = 0; i < 16; ++i) {
    const ViewChange change = ViewChange::Draw(random);
    const AffineMap map = change.Positions(key.size(2), key.size(3));
    const torch::Tensor grid = SamplingGrid(map, key.size(2), key.size(3));
    const torch::Tensor answer = model.Forward(change.InLight(Warp(key, grid, Border::kReflect)));
    const torch::Tensor back = SamplingGrid(Inverse(map), answer.size(2), answer.size(3));
    answers.push_back(Warp(answer, back, Border::kRepeat));
  }
  return torch::cat(answers).var(0, /*unbiased=*/true).mean().item<double>();
}

TEST_F(TrainingTest, ConsistencyReducesVarianceOfAnswers) {
  NoCheckpoints none;
  NullObserver progress;
  PersonalModel plain = MakeModel();
  Train(plain, none, progress);
  options_.consistency_weight = 100.0;
  PersonalModel consistent = MakeModel();
  Train(consistent, none, progress);
  EXPECT_LT(VarianceOfAnswers(consistent, KeyTensor()),
            0.8 * VarianceOfAnswers(plain, KeyTensor()));
}

TEST_F(TrainingTest, ChangedSampleShowsSamePoints) {
  Image& smooth = pictures_[0].luminance;
  for (int y = 0; y < smooth.height; ++y) {
    for (int x = 0; x < smooth.width; ++x) {
      smooth.At(0, y, x) = 50.0f + 15.0f * std::sin(0.15f * x) + 15.0f * std::cos(0.2f * y);
    }
  }
  PersonalModel model = MakeModel();
  const TrainingSamples samples(pictures_, recipe_.augment, options_, model);
  const TrainingSample sample = samples.Draw(3);
  const ChangedSample changed = samples.Change(sample, 3);
  const torch::Tensor luminance =
      Warp(torch::avg_pool2d(sample.luminance, {2, 2}), changed.grid, Border::kRepeat);
  const torch::Tensor shown = torch::avg_pool2d(changed.luminance, {2, 2});
  const torch::Tensor inside = changed.weight > 0.99;
  ASSERT_GT(inside.sum().item<double>(), 100.0);
  // Light is an affine change of the values, which leaves their correlation.
  const torch::Tensor x = luminance.masked_select(inside), y = shown.masked_select(inside);
  const torch::Tensor dx = x - x.mean(), dy = y - y.mean();
  const double correlation =
      (dx * dy).sum().item<double>() /
      std::sqrt(dx.square().sum().item<double>() * dy.square().sum().item<double>());
  EXPECT_GT(correlation, 0.9);
  // Other numbers have other changes, equal numbers the same.
  EXPECT_FALSE(torch::equal(samples.Change(sample, 4).luminance, changed.luminance));
  EXPECT_TRUE(torch::equal(samples.Change(sample, 3).luminance, changed.luminance));
}

TEST_F(TrainingTest, ResumesWithSameResult) {
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

TEST_F(TrainingTest, HelperThreadDoesNotChangeResult) {
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

TEST_F(TrainingTest, StopsEarlyAlsoAfterResuming) {
  options_.iterations = 400;
  options_.min_improvement = 0.5;
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

TEST_F(TrainingTest, KeepsAverageWhenItIsBetter) {
  NoCheckpoints none;
  Warnings averaged, plain;
  options_.iterations = 60;
  recipe_.last_learning_rate = recipe_.first_learning_rate;  // noisy last step
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

TEST_F(TrainingTest, IgnoresForeignOrDamagedCheckpoint) {
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

TEST_F(TrainingTest, RollsBackAfterDivergence) {
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

TEST_F(TrainingTest, ShortensScheduleToTimeLimit) {
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

}  // namespace
}  // namespace color3d
