// Pre-training of the embedded encoder and its colour head: automatic colourization as
// classification (Zhang, Isola & Efros 2016), distillation of a teacher's features into the taps,
// and a loss of copied colours (copy_loss.h). Torch in the interface. Not thread-safe.
#pragma once

#include <torch/types.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/colorizer/model/named_tensors.h"
#include "core/encoder/convnext/convnext.h"
#include "core/keycolor/automatic/color_head.h"
#include "tests/bench/pretrain/color_bins.h"
#include "tests/bench/pretrain/copy_loss.h"
#include "tests/bench/pretrain/photo_set.h"
#include "tests/bench/pretrain/squeezenet.h"

namespace color3d {

struct PretrainOptions {
  int iterations = 8000;
  int batch = 16;
  int size_px = 128;            // size of crops in the first half
  int late_size_px = 192;       // and in the second half
  double learning_rate = 2e-3;  // maximum, followed by a cosine to 1 %
  double weight_decay = 0.02;
  double distillation_weight = 1.0;
  double rebalancing_power = 0.5;
  double prior_share = 1.0;  // share of the rebalancing that inference undoes
  double min_bin_share = 2e-5;
  // Above 0, batches consist of pairs of views. Contrast supervises the matched cell, copying only
  // its colour.
  double copy_weight = 0.0;
  double contrast_weight = 0.0;
  CopyLossOptions copying;
  bool half_precision = false;  // networks run in bfloat16, weights and losses stay float32
  torch::Device device = torch::kCPU;
  uint64_t seed = 1;
};

struct PretrainLosses {
  double color = 0.0;         // cross entropy, nats
  double distillation = 0.0;  // mean squared error of standardised features, over the three levels
  double copy = 0.0;          // CopyLosses, the mean over the pairs
  double contrast = 0.0;
  double logits = 0.0;  // Kullback-Leibler divergence to the teacher's classes, nats
};

class Pretrainer {
 public:
  // `photos` must outlive the object. No distillation without a teacher. `start`: initial weights
  // as from AveragedWeights, instead of random ones; throws Error{kInvalidArgument} if they do not
  // fit.
  Pretrainer(const PretrainOptions& options,
             const PhotoSet& photos,
             std::optional<SqueezeNet> teacher,
             const WeightMap* start = nullptr);

  int64_t iteration() const { return iteration_; }
  // Runs an optimiser step. `progress`: completed share of the schedule, 0..1; by default derived
  // from the iteration. Throws Error{kInternal} if the loss is not finite ten times in a row.
  PretrainLosses Step(std::optional<double> progress = std::nullopt);

  // Saves and restores the whole state. A resumed run has the same result.
  std::string Checkpoint(const std::string& notes_json) const;
  // Returns the notes. Throws Error{kInvalidArgument} if the bytes are damaged or of another
  // network.
  std::string Restore(std::string_view bytes);

  // Averaged weights as they are shipped: "encoder.*", "color_head.*", "color_bins" [K,2] and
  // "color_weights" [K].
  WeightMap AveragedWeights() const;

 private:
  // Everything that a checkpoint holds besides numbers; storage is shared.
  NamedTensors State() const;
  // A batch. In batches of pairs the first views precede the second ones.
  struct Batch {
    std::vector<TrainingCrop> crops;
    std::vector<Image> matches;  // empty without pairs
  };
  Batch NextBatch(double progress);
  PretrainLosses Losses(const Batch& batch, torch::Tensor& total);
  torch::Tensor Stack(const std::vector<TrainingCrop>& crops, Image TrainingCrop::*member) const;
  // Shares of the bins for the mean colour of each cell, the same cells as those of the head:
  // [B, cells, K].
  torch::Tensor SoftBins(const torch::Tensor& ab) const;
  torch::Tensor ColorLoss(const torch::Tensor& logits, const torch::Tensor& colors) const;
  void Copy(const std::vector<torch::Tensor>& taps,
            const torch::Tensor& luminance,
            const torch::Tensor& colors,
            const std::vector<Image>& matches,
            torch::Tensor& total,
            PretrainLosses& losses);
  void Distill(const std::vector<torch::Tensor>& taps,
               const torch::Tensor& srgb,
               torch::Tensor& total,
               PretrainLosses& losses);
  torch::Tensor NewStudentHead(const std::string& name, std::vector<int64_t> shape);
  void OptimiserStep(double progress);

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
  bool started_ = false;                                         // from weights
  int64_t iteration_ = 0;
  int bad_steps_ = 0;
};

}  // namespace color3d
