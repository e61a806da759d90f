// The training loop of one personalized colorizer. Torch in the interface; used inside
// core/colorizer only. Not thread-safe.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/progress.h"
#include "core/colorizer/adam.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/personal_model.h"
#include "core/colorizer/recipe.h"

namespace color3d {

// One point of the error-against-time curve.
struct TrainingPoint {
  int64_t iteration = 0;
  double seconds = 0.0;
  double train_l1_ab = 0.0;           // Lab units, running mean
  double validation_delta_e00 = 0.0;  // on augmentations that are never trained on
};

class Trainer {
 public:
  // `pictures` at training size, the key view first; they must outlive the trainer. `model` is
  // changed in place.
  Trainer(const std::vector<TrainingPicture>& pictures,
          const ColorizerOptions& options,
          const TrainingRecipe& recipe,
          PersonalModel& model);

  void Run(CheckpointStore& checkpoints,
           ProgressObserver& progress,
           const CancellationToken& cancel);

  const std::vector<TrainingPoint>& curve() const { return curve_; }
  int rollbacks() const { return rollbacks_; }

 private:
  struct Sample {
    torch::Tensor luminance;  // [1,1,c,c]
    torch::Tensor ab;         // [1,2,c/s,c/s], / kAbScale
    torch::Tensor weight;     // [1,1,c/s,c/s], 0 outside the picture
  };
  Sample Draw(const TrainingPicture& picture, const AugmentOptions& options, Random& random) const;
  const TrainingPicture& Choose(Random& random) const;
  torch::Tensor Loss(const Sample& sample) const;
  // One iteration; false when the loss or the gradient is unusable and nothing was changed.
  bool Iterate();
  double Progress() const;  // 0..1, by iterations or by time, whichever is further
  double LearningRate() const;
  void KeepGoodState();
  void RollBack(ProgressObserver& progress);
  void Report(ProgressObserver& progress);
  double ValidationDeltaE00() const;
  std::string SaveState() const;
  void LoadState(const std::string& state);
  std::string Fingerprint() const;

  const std::vector<TrainingPicture>& pictures_;
  ColorizerOptions options_;
  TrainingRecipe recipe_;
  PersonalModel& model_;
  Adam adam_;
  Random random_;
  std::vector<Sample> validation_;
  int64_t iteration_ = 0;
  double seconds_ = 0.0;
  double learning_rate_scale_ = 1.0;
  double running_loss_ = 0.0;  // Lab units / kAbScale; 0: none yet
  int rollbacks_ = 0;
  std::vector<torch::Tensor> good_state_;
  int64_t good_steps_ = 0;
  double good_running_loss_ = 0.0;
  std::vector<TrainingPoint> curve_;
};

}  // namespace color3d
