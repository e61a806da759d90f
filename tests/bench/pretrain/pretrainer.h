// Pre-training of the embedded encoder and its colour head: automatic colourization as
// classification (Zhang, Isola & Efros 2016), beside distillation of a teacher's features into the
// taps. Torch in the interface. Not thread-safe.
#pragma once

#include <torch/types.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/colorizer/named_tensors.h"
#include "core/encoder/convnext/convnext.h"
#include "core/keycolor/automatic/color_head.h"
#include "tests/bench/pretrain/color_bins.h"
#include "tests/bench/pretrain/photo_set.h"
#include "tests/bench/pretrain/squeezenet.h"

namespace color3d {

struct PretrainOptions {
  int iterations = 8000;
  int batch = 16;
  int size_px = 128;            // crops in the first half
  int late_size_px = 192;       // and in the second
  double learning_rate = 2e-3;  // at its highest, then a cosine to 1 %
  double weight_decay = 0.02;
  double distillation_weight = 1.0;
  double rebalancing_power = 0.5;
  double min_bin_share = 2e-5;
  uint64_t seed = 1;
};

struct PretrainLosses {
  double color = 0.0;         // cross entropy, nats
  double distillation = 0.0;  // mean squared error of standardised features, over the three levels
  double logits = 0.0;        // Kullback-Leibler divergence to the teacher's classes, nats
};

class Pretrainer {
 public:
  // `photos` must outlive it; without a teacher there is no distillation.
  Pretrainer(const PretrainOptions& options,
             const PhotoSet& photos,
             std::optional<SqueezeNet> teacher);

  int64_t iteration() const { return iteration_; }
  // One optimiser step. Throws Error{kInternal} when the loss is not finite ten times running.
  PretrainLosses Step();

  // The whole state, and back: a resumed run goes on as if it had never stopped.
  std::string Checkpoint(const std::string& notes_json) const;
  // Returns the notes. Throws Error{kInvalidArgument} when the bytes are damaged or of another
  // network.
  std::string Restore(std::string_view bytes);

  // Averaged weights as they are shipped: "encoder.*", "color_head.*", "color_bins" [K,2].
  WeightMap AveragedWeights() const;

 private:
  // Everything that a checkpoint holds besides numbers; storage is shared.
  NamedTensors State() const;
  PretrainLosses Losses(const std::vector<TrainingCrop>& crops, torch::Tensor& total);
  torch::Tensor ColorLoss(const std::vector<torch::Tensor>& taps, const torch::Tensor& ab) const;
  void Distill(const std::vector<torch::Tensor>& taps,
               const torch::Tensor& srgb,
               torch::Tensor& total,
               PretrainLosses& losses);
  torch::Tensor NewStudentHead(const std::string& name, std::vector<int64_t> shape);
  void OptimiserStep();

  PretrainOptions options_;
  const PhotoSet& photos_;
  std::optional<SqueezeNet> teacher_;
  Random random_;
  std::unique_ptr<ConvNext> encoder_;
  std::unique_ptr<ColorHead> head_;
  torch::Tensor bins_;         // [K,2]
  torch::Tensor bin_weights_;  // [K]
  torch::Tensor match4_, match8_, match16_, match_logits_;
  NamedTensors parameters_;
  std::vector<torch::Tensor> first_, second_, average_;
  std::vector<torch::Tensor> teacher_mean_, teacher_deviation_;  // running, per level
  int64_t iteration_ = 0;
  int bad_steps_ = 0;
};

}  // namespace color3d
