// Training of a personalized colorizer, one iteration per call, so that the loops over one and over
// several scenes share the code. Torch in the interface; used inside core/colorizer only. Not
// thread-safe. All arithmetic is single-threaded (the caller's torch threads are set to 1 during a
// step), so that the result does not depend on other computations.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/model/personal_model.h"
#include "core/colorizer/training/adam.h"
#include "core/colorizer/training/early_stop.h"
#include "core/colorizer/training/recipe.h"
#include "core/colorizer/training/training_curve.h"
#include "core/colorizer/training/training_samples.h"

namespace color3d {

class TrainingSession {
 public:
  // `pictures` at training size, the key view first. Trains `model` in place. `pictures` and
  // `model` must outlive the session.
  TrainingSession(const std::vector<TrainingPicture>& pictures,
                  const ColorizerOptions& options,
                  const TrainingRecipe& recipe,
                  PersonalModel& model);

  // Continues from the bytes of Checkpoint(), with the same result as without an interruption.
  // Warns about a state that is damaged or belongs to other options or pictures, and ignores it.
  void Resume(const std::optional<std::string>& state, ProgressObserver& progress);

  // Mean CIEDE2000 on held-out crops of the key view. `predict` returns the ab of a sample in the
  // form of TrainingSample::ab.
  double HeldOutError(
      const std::function<torch::Tensor(const TrainingSample& sample)>& predict) const;
  // The same of the present parameters.
  double HeldOutError() const;

  bool Finished() const { return course_.stopped_early || Progress() >= 1.0; }
  // Runs one iteration. `helpers`: null, or a pool whose second thread prepares the next sample
  // meanwhile, without effect on the result.
  void Step(ProgressObserver& progress, ThreadPool* helpers);
  // Returns whether Checkpoint() may be called.
  bool AtCheckpoint() const {
    return course_.iteration > 0 && course_.iteration % kGoodStateInterval == 0;
  }
  std::string Checkpoint() const;
  // Sets the model to the better one of the last and the averaged parameters. Call once, at the
  // end.
  void KeepBetterParameters(ProgressObserver& progress);

  const std::vector<TrainingPoint>& curve() const { return course_.curve; }
  int rollbacks() const { return course_.rollbacks; }
  int64_t iteration() const { return course_.iteration; }
  bool stopped_early() const { return course_.stopped_early; }

 private:
  static constexpr int kGoodStateInterval = 25;

  // State of training besides the tensors. Stored in checkpoints.
  struct Course {
    int64_t iteration = 0;
    double seconds = 0.0;  // computing time
    double learning_rate_scale = 1.0;
    double running_loss = 0.0;       // in units of kAbScale; 0: none yet
    double best_running_loss = 0.0;  // since the last rollback; 0: none yet
    int rollbacks = 0;
    bool stopped_early = false;
    std::vector<TrainingPoint> curve;
  };
  // State that a rollback restores.
  struct GoodState {
    std::vector<torch::Tensor> tensors;  // in half precision
    int64_t steps = 0;
    double running_loss = 0.0;
  };

  // `taps` may be empty.
  torch::Tensor Predict(const std::vector<torch::Tensor>& taps,
                        const torch::Tensor& luminance) const;
  torch::Tensor Loss(const TrainingSample& sample) const;
  // The consistency term: mean squared difference of `predicted`, the answer to `sample`, from the
  // answer to a second augmentation, where both show the same point.
  torch::Tensor Inconsistency(const torch::Tensor& predicted, const TrainingSample& sample) const;
  // Runs one iteration. Returns false, without changes, if loss or gradient are unusable.
  bool TrainOn(const TrainingSample& sample);
  bool HasDrifted() const;
  void UpdateAverage();
  void SwapWithAverage();
  double Progress() const;  // 0..1, the larger one of the shares of iterations and of time
  double LearningRate() const;
  void KeepGoodState();
  void RollBack(ProgressObserver& progress);
  void Report(ProgressObserver& progress);
  NamedTensors Average() const;  // by name of the parameter
  void LoadState(const std::string& state);

  ColorizerOptions options_;
  TrainingRecipe recipe_;
  PersonalModel& model_;
  TrainingSamples samples_;
  Adam adam_;
  EarlyStop early_stop_;
  std::optional<TrainingSample> next_;  // prepared in advance
  std::vector<torch::Tensor> average_;  // average of the parameters; empty: off
  Course course_;
  GoodState good_;
};

}  // namespace color3d
