// Training samples: augmented crops of the scene's pictures, one per iteration, which depend on the
// seed and the iteration alone. Torch in the interface; used inside core/colorizer only.
// Thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/model/personal_model.h"
#include "core/colorizer/training/recipe.h"

namespace color3d {

struct TrainingSample {
  torch::Tensor luminance;          // [1,1,c,c]
  torch::Tensor ab;                 // [1,2,c/s,c/s], in units of kAbScale
  torch::Tensor weight;             // [1,1,c/s,c/s], 0 outside the picture
  std::vector<torch::Tensor> taps;  // taps of the frozen encoder; empty with adapters
};

// A second augmentation of a sample (ViewChange).
struct ChangedSample {
  torch::Tensor luminance;          // [1,1,c,c]
  torch::Tensor grid;               // [1,c/s,c/s,2]: position of each answer in the sample's
  torch::Tensor weight;             // [1,1,c/s,c/s]: of the sample at these positions, 0 outside
  std::vector<torch::Tensor> taps;  // as TrainingSample::taps
};

class TrainingSamples {
 public:
  // The references must outlive the object.
  TrainingSamples(const std::vector<TrainingPicture>& pictures,
                  const AugmentOptions& augment,
                  const ColorizerOptions& options,
                  const PersonalModel& model);

  // Returns the sample of iteration `number`.
  TrainingSample Draw(int64_t number) const;
  // Returns a second augmentation of it. Depends on the seed and `number`, too.
  ChangedSample Change(const TrainingSample& sample, int64_t number) const;
  // Held-out crops of the key view.
  const std::vector<TrainingSample>& held_out() const { return held_out_; }
  // SHA-256 over all pictures.
  std::string Digest() const;

 private:
  const TrainingPicture& Choose(Random& random) const;
  TrainingSample Make(const TrainingPicture& picture,
                      const AugmentOptions& options,
                      Random& random) const;

  const std::vector<TrainingPicture>& pictures_;
  const PersonalModel& model_;
  AugmentOptions augment_;
  uint64_t seed_;
  std::vector<TrainingSample> held_out_;
};

}  // namespace color3d
