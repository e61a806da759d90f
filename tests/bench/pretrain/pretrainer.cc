#include "tests/bench/pretrain/pretrainer.h"

#include <fmt/format.h>
#include <torch/types.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/base/error.h"
#include "core/colorizer/named_tensors.h"
#include "core/encoder/image_tensors.h"
#include "tests/support/networks/random_features.h"

namespace color3d {
namespace {

constexpr TensorFormat kFormat = {"color3d.pretraining", 2, "C3PRETRN", "start afresh"};
constexpr double kBeta1 = 0.9;
constexpr double kBeta2 = 0.98;
constexpr double kEpsilon = 1e-8;
constexpr double kMaxGradient = 1.0;
constexpr int kWarmUp = 200;
constexpr double kSoftSigma = 5.0;  // Lab units, as Zhang et al.
constexpr double kUniformShare = 0.3;
constexpr double kLogitsTemperature = 2.0;
constexpr double kLogitsWeight = 0.3;
constexpr int kHistogramCrops = 4000;
constexpr double kBlockScale = 0.3;  // start of gamma: residual branches begin small
constexpr int kMaxBadSteps = 10;

torch::Tensor Stack(const std::vector<TrainingCrop>& crops, Image TrainingCrop::*member) {
  std::vector<torch::Tensor> tensors;
  for (const TrainingCrop& crop : crops) tensors.push_back(TensorFromImage(crop.*member));
  return torch::cat(tensors);
}

// Start of the encoder: He-scaled layers; the stem keeps the Gabor filters of the random features.
std::unique_ptr<ConvNext> NewEncoder(const ConvNextConfig& config, uint64_t seed) {
  auto encoder = std::make_unique<ConvNext>(
      config, RandomFeatureWeights(config, seed), "ConvNeXt in pre-training");
  Random random(seed, 7);
  for (auto& [name, tensor] : encoder->Parameters()) {
    if (name.ends_with("gamma")) tensor.fill_(kBlockScale);
    if (tensor.dim() < 2 || name.starts_with("downsample_layers.0.")) continue;
    const double deviation = std::sqrt(1.0 / static_cast<double>(tensor[0].numel()));
    torch::Tensor plain = torch::empty(tensor.sizes());
    float* values = plain.data_ptr<float>();
    for (int64_t i = 0; i < plain.numel(); ++i) {
      values[i] = static_cast<float>(deviation * random.NextNormal());
    }
    torch::Tensor target = tensor;
    target.copy_(plain);
  }
  for (auto& [name, tensor] : encoder->Parameters()) {
    if (name.ends_with("bias") && !name.starts_with("downsample_layers.0.")) tensor.zero_();
  }
  return encoder;
}

}  // namespace

Pretrainer::Pretrainer(const PretrainOptions& options,
                       const PhotoSet& photos,
                       std::optional<SqueezeNet> teacher)
    : options_(options),
      photos_(photos),
      teacher_(std::move(teacher)),
      random_(options.seed, 1),
      encoder_(NewEncoder(ConvNextConfig(), options.seed)) {
  // Moments and soft targets run into denormal numbers, which made a step four times as slow.
  at::globalContext().setFlushDenormal(true);
  ColorHistogram histogram;
  Random counting(options.seed, 2);
  for (int i = 0; i < kHistogramCrops; ++i) histogram.Add(photos.Crop(32, counting).ab);
  const std::vector<ColorHistogram::Bin> bins = histogram.Bins(options.min_bin_share);
  bins_ = torch::empty({static_cast<int64_t>(bins.size()), 2});
  for (size_t i = 0; i < bins.size(); ++i) {
    bins_[static_cast<int64_t>(i)][0] = bins[i].center_ab[0];
    bins_[static_cast<int64_t>(i)][1] = bins[i].center_ab[1];
  }
  bin_weights_ = torch::tensor(RebalancingWeights(bins, kUniformShare, options.rebalancing_power));
  Random start(options.seed, 3);
  head_ = std::make_unique<ColorHead>(encoder_->config(), static_cast<int>(bins.size()), start);
  for (const auto& [name, tensor] : encoder_->Parameters()) {
    parameters_.emplace_back("encoder." + name, tensor);
  }
  for (const auto& [name, tensor] : head_->Parameters()) {
    parameters_.emplace_back("color_head." + name, tensor);
  }
  const std::vector<int>& dims = encoder_->config().dims;
  match4_ = NewStudentHead("match.4", {128, dims[1], 1, 1});
  match8_ = NewStudentHead("match.8", {256, dims[2], 1, 1});
  match16_ = NewStudentHead("match.16", {512, dims[3] + dims[4], 1, 1});
  match_logits_ = NewStudentHead("match.logits", {1000, dims[4]});
  for (auto& [name, tensor] : parameters_) {
    first_.push_back(torch::zeros_like(tensor));
    second_.push_back(torch::zeros_like(tensor));
    average_.push_back(tensor.clone());
    tensor.set_requires_grad(true);
  }
  for (int channels : {128, 256, 512}) {
    teacher_mean_.push_back(torch::zeros({channels}));
    teacher_deviation_.push_back(torch::ones({channels}));
  }
}

torch::Tensor Pretrainer::NewStudentHead(const std::string& name, std::vector<int64_t> shape) {
  torch::Tensor tensor = torch::empty(shape);
  Random random(options_.seed, 11 + static_cast<uint64_t>(parameters_.size()));
  const double deviation = std::sqrt(1.0 / static_cast<double>(shape[1]));
  float* values = tensor.data_ptr<float>();
  for (int64_t i = 0; i < tensor.numel(); ++i) {
    values[i] = static_cast<float>(deviation * random.NextNormal());
  }
  parameters_.emplace_back(name, tensor);
  return tensor;
}

torch::Tensor Pretrainer::ColorLoss(const std::vector<torch::Tensor>& taps,
                                    const torch::Tensor& ab) const {
  const torch::Tensor logits = head_->Forward(taps).permute({0, 2, 3, 1});
  torch::Tensor target;
  torch::Tensor weight;
  {
    torch::NoGradGuard no_grad;
    const int64_t stride = ab.size(2) / logits.size(1);
    const torch::Tensor cells =
        torch::avg_pool2d(ab, {stride, stride}).permute({0, 2, 3, 1}).reshape({-1, 2});
    // exp(-d^2 / 2 sigma^2), normalised: only the part of d^2 that differs between bins matters.
    const torch::Tensor score = torch::addmm(bins_.square().sum(1).mul(-0.5), cells, bins_.t());
    target = torch::softmax(score / (kSoftSigma * kSoftSigma), 1);
    weight = target.mv(bin_weights_);
  }
  const torch::Tensor log_p = torch::log_softmax(logits.reshape({-1, bins_.size(0)}), 1);
  return -((target * log_p).sum(1) * weight).mean();
}

void Pretrainer::Distill(const std::vector<torch::Tensor>& taps,
                         const torch::Tensor& srgb,
                         torch::Tensor& total,
                         PretrainLosses& losses) {
  const SqueezeNet::Features wanted = teacher_->Run(srgb);
  const torch::Tensor coarse =
      torch::upsample_bilinear2d(taps[4], {taps[3].size(2), taps[3].size(3)}, false);
  const std::vector<torch::Tensor> students{taps[1], taps[2], torch::cat({taps[3], coarse}, 1)};
  const std::vector<torch::Tensor> matches{match4_, match8_, match16_};
  const std::vector<torch::Tensor> teachers{wanted.fire3, wanted.fire5, wanted.fire9};
  for (size_t i = 0; i < students.size(); ++i) {
    torch::Tensor standard;
    {
      torch::NoGradGuard no_grad;
      const double keep = iteration_ == 0 ? 0.0 : 0.98;
      const torch::Tensor flat = teachers[i].permute({1, 0, 2, 3}).flatten(1);
      teacher_mean_[i].mul_(keep).add_(flat.mean(1), 1.0 - keep);
      teacher_deviation_[i].mul_(keep).add_(flat.std(1, false), 1.0 - keep);
      standard = ((teachers[i] - teacher_mean_[i].view({1, -1, 1, 1})) /
                  (teacher_deviation_[i].view({1, -1, 1, 1}) + 1e-3 * teacher_deviation_[i].mean()))
                     .clamp(-4.0, 4.0);
    }
    // The teacher pads nothing: its cell i lies on the corner between our cells i and i + 1.
    const torch::Tensor aligned = torch::avg_pool2d(students[i], {2, 2}, {1, 1});
    const torch::Tensor predicted = torch::conv2d(aligned, matches[i]);
    const int64_t rows = std::min(predicted.size(2), standard.size(2));
    const auto trim = [rows](const torch::Tensor& t) {
      return t.narrow(2, 0, rows).narrow(3, 0, rows);
    };
    const torch::Tensor loss = (trim(predicted) - trim(standard)).square().mean();
    losses.distillation += loss.item<double>() / 3.0;
    total = total + options_.distillation_weight * loss;
  }
  const torch::Tensor logits = torch::linear(taps[4].mean({2, 3}), match_logits_);
  const torch::Tensor p = torch::softmax(wanted.logits / kLogitsTemperature, 1);
  const torch::Tensor log_q = torch::log_softmax(logits / kLogitsTemperature, 1);
  const torch::Tensor divergence = (p * (p.clamp_min(1e-9).log() - log_q)).sum(1).mean();
  losses.logits = divergence.item<double>();
  total = total + kLogitsWeight * kLogitsTemperature * kLogitsTemperature *
                      options_.distillation_weight * divergence;
}

PretrainLosses Pretrainer::Step() {
  const bool late = iteration_ >= options_.iterations / 2;
  const int size = late ? options_.late_size_px : options_.size_px;
  std::vector<TrainingCrop> crops;
  for (int i = 0; i < options_.batch; ++i) crops.push_back(photos_.Crop(size, random_));
  torch::Tensor total;
  const PretrainLosses losses = Losses(crops, total);
  if (std::isfinite(total.item<double>())) {
    total.backward();
    OptimiserStep();
    bad_steps_ = 0;
  } else if (++bad_steps_ >= kMaxBadSteps) {
    throw Error(ErrorCode::kInternal,
                "pre-training diverged at iteration {}: lower --learning-rate",
                iteration_);
  }
  ++iteration_;
  return losses;
}

PretrainLosses Pretrainer::Losses(const std::vector<TrainingCrop>& crops, torch::Tensor& total) {
  PretrainLosses losses;
  const std::vector<torch::Tensor> taps =
      encoder_->Taps(encoder_->Input(Stack(crops, &TrainingCrop::luminance)));
  total = ColorLoss(taps, Stack(crops, &TrainingCrop::ab));
  losses.color = total.item<double>();
  if (teacher_) Distill(taps, Stack(crops, &TrainingCrop::srgb), total, losses);
  return losses;
}

// AdamW (Loshchilov & Hutter 2019) with clipping, and the running average that is shipped.
void Pretrainer::OptimiserStep() {
  torch::NoGradGuard no_grad;
  double squares = 0.0;
  for (auto& [name, tensor] : parameters_) {
    if (tensor.grad().defined()) squares += tensor.grad().square().sum().item<double>();
  }
  const double norm = std::sqrt(squares);
  const double t = static_cast<double>(iteration_ + 1);
  const double progress = std::min(1.0, t / options_.iterations);
  const double cosine = 0.5 * (1.0 + std::cos(std::numbers::pi * progress));
  const double rate = options_.learning_rate * (0.01 + 0.99 * cosine) * std::min(1.0, t / kWarmUp);
  const double clip = std::isfinite(norm) ? std::min(1.0, kMaxGradient / (norm + 1e-12)) : 0.0;
  const double keep = std::min(0.999, (1.0 + t) / (10.0 + t));
  for (size_t i = 0; i < parameters_.size(); ++i) {
    torch::Tensor& tensor = parameters_[i].second;
    const torch::Tensor gradient = tensor.grad();
    if (gradient.defined() && clip > 0.0) {
      first_[i].mul_(kBeta1).add_(gradient, (1.0 - kBeta1) * clip);
      second_[i].mul_(kBeta2).addcmul_(gradient, gradient, (1.0 - kBeta2) * clip * clip);
      const torch::Tensor denominator =
          second_[i].sqrt().div_(std::sqrt(1.0 - std::pow(kBeta2, t))).add_(kEpsilon);
      if (tensor.dim() >= 2) tensor.mul_(1.0 - rate * options_.weight_decay);
      tensor.addcdiv_(first_[i], denominator, -rate / (1.0 - std::pow(kBeta1, t)));
    }
    tensor.mutable_grad() = torch::Tensor();
    average_[i].mul_(keep).add_(tensor, 1.0 - keep);
  }
}

NamedTensors Pretrainer::State() const {
  NamedTensors state;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    const std::string& name = parameters_[i].first;
    state.emplace_back("w." + name, parameters_[i].second);
    state.emplace_back("m." + name, first_[i]);
    state.emplace_back("v." + name, second_[i]);
    state.emplace_back("average." + name, average_[i]);
  }
  for (size_t i = 0; i < teacher_mean_.size(); ++i) {
    state.emplace_back(fmt::format("teacher.mean.{}", i), teacher_mean_[i]);
    state.emplace_back(fmt::format("teacher.deviation.{}", i), teacher_deviation_[i]);
  }
  return state;
}

std::string Pretrainer::Checkpoint(const std::string& notes_json) const {
  TensorFile file;
  file.facts = {{"iteration", iteration_},
                {"random_state", random_.state().state},
                {"random_increment", random_.state().increment},
                {"notes", nlohmann::json::parse(notes_json)}};
  PutTensors(State(), "", StoredType::kFloat32, &file);
  return WriteTensorFile(file, kFormat);
}

std::string Pretrainer::Restore(std::string_view bytes) {
  const std::string what = "the pre-training checkpoint";
  TensorFile file = ReadTensorFile(bytes, kFormat, what);
  TakeTensors(State(), "", what, &file);
  iteration_ = file.facts.at("iteration").get<int64_t>();
  random_ = Random(Random::State{file.facts.at("random_state").get<uint64_t>(),
                                 file.facts.at("random_increment").get<uint64_t>()});
  return file.facts.at("notes").dump();
}

WeightMap Pretrainer::AveragedWeights() const {
  WeightMap weights;
  const auto add = [&weights](const std::string& name, const torch::Tensor& tensor) {
    const torch::Tensor plain = tensor.detach().contiguous(at::MemoryFormat::Contiguous);
    weights[name] = {
        plain.sizes().vec(),
        std::vector<float>(plain.data_ptr<float>(), plain.data_ptr<float>() + plain.numel())};
  };
  for (size_t i = 0; i < parameters_.size(); ++i) {
    if (!parameters_[i].first.starts_with("match.")) add(parameters_[i].first, average_[i]);
  }
  add("color_bins", bins_);
  return weights;
}

}  // namespace color3d
