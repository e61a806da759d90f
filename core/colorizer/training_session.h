// The training of one personalized colorizer, stepped from outside, so that one scene's loop and
// many scenes' loops are the same code. Torch in the interface; used inside core/colorizer only.
// Not thread-safe. All arithmetic is single-threaded (the caller's torch threads are set to 1 while
// a step runs), so that the result does not depend on who else computes beside it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/colorizer/adam.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/early_stop.h"
#include "core/colorizer/personal_model.h"
#include "core/colorizer/recipe.h"
#include "core/colorizer/training_curve.h"
#include "core/colorizer/training_samples.h"

namespace color3d {

class TrainingSession {
 public:
  // `pictures` at training size, the key view first; they must outlive the session. `model` is
  // changed in place.
  TrainingSession(const std::vector<TrainingPicture>& pictures,
                  const ColorizerOptions& options,
                  const TrainingRecipe& recipe,
                  PersonalModel& model);

  // Goes on from Checkpoint()'s bytes, to the same end as if it had not been interrupted. A state
  // that is damaged or belongs to other work is reported as a warning and ignored.
  void Resume(const std::optional<std::string>& state, ProgressObserver& progress);

  bool Finished() const { return course_.stopped_early || Progress() >= 1.0; }
  // One iteration. `helpers`: null, or a pool whose second thread prepares the next sample
  // meanwhile; the result is the same.
  void Step(ProgressObserver& progress, ThreadPool* helpers);
  // Checkpoint() may be called now.
  bool AtCheckpoint() const {
    return course_.iteration > 0 && course_.iteration % kGoodStateInterval == 0;
  }
  std::string Checkpoint() const;
  // Leaves the better of the last and the averaged parameters in the model. Once, at the end.
  void Conclude(ProgressObserver& progress);

  const std::vector<TrainingPoint>& curve() const { return course_.curve; }
  int rollbacks() const { return course_.rollbacks; }
  int64_t iteration() const { return course_.iteration; }
  bool stopped_early() const { return course_.stopped_early; }

 private:
  static constexpr int kGoodStateInterval = 25;

  // Where training stands, besides the tensors: all of it goes into checkpoints.
  struct Course {
    int64_t iteration = 0;
    double seconds = 0.0;  // of computing
    double learning_rate_scale = 1.0;
    double running_loss = 0.0;       // Lab units / kAbScale; 0: none yet
    double best_running_loss = 0.0;  // since the last rollback; 0: none yet
    int rollbacks = 0;
    bool stopped_early = false;
    std::vector<TrainingPoint> curve;
  };
  // What a rollback goes back to.
  struct GoodState {
    std::vector<torch::Tensor> tensors;  // 16 bits per value
    int64_t steps = 0;
    double running_loss = 0.0;
  };

  torch::Tensor Predict(const TrainingSample& sample) const;
  torch::Tensor Loss(const TrainingSample& sample) const;
  // One iteration; false when the loss or the gradient is unusable and nothing was changed.
  bool TrainOn(const TrainingSample& sample);
  bool HasDrifted() const;
  void UpdateAverage();
  void SwapWithAverage();
  double Progress() const;  // 0..1, by iterations or by time, whichever is further
  double LearningRate() const;
  void KeepGoodState();
  void RollBack(ProgressObserver& progress);
  void Report(ProgressObserver& progress);
  double ValidationDeltaE00() const;
  NamedTensors Average() const;  // by the parameters' names
  void LoadState(const std::string& state);

  ColorizerOptions options_;
  TrainingRecipe recipe_;
  PersonalModel& model_;
  TrainingSamples samples_;
  Adam adam_;
  EarlyStop early_stop_;
  std::optional<TrainingSample> next_;  // prepared ahead
  std::vector<torch::Tensor> average_;  // of the parameters; empty: off
  Course course_;
  GoodState good_;
};

}  // namespace color3d
