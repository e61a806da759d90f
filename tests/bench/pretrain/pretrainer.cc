#include "tests/bench/pretrain/pretrainer.h"

#include <ATen/autocast_mode.h>
#include <fmt/format.h>
#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/base/error.h"
#include "core/colorizer/model/named_tensors.h"
#include "core/encoder/image_tensors.h"
#include "core/matching/cell_features.h"
#include "tests/bench/pretrain/network_start.h"

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
constexpr int kMaxBadSteps = 10;
// Learning rate of new weights, relative to that of weights that were trained before.
constexpr double kFreshRate = 5.0;

// Runs networks in bfloat16 during its lifetime.
class HalfPrecision {
 public:
  explicit HalfPrecision(bool on) : before_(at::autocast::is_cpu_enabled()) {
    at::autocast::set_cpu_enabled(on);
    at::autocast::set_autocast_cpu_dtype(torch::kBFloat16);
  }
  ~HalfPrecision() {
    at::autocast::clear_cache();
    at::autocast::set_cpu_enabled(before_);
  }
  HalfPrecision(const HalfPrecision&) = delete;
  HalfPrecision& operator=(const HalfPrecision&) = delete;

 private:
  bool before_;
};

}  // namespace

Pretrainer::Pretrainer(const PretrainOptions& options,
                       const PhotoSet& photos,
                       std::optional<SqueezeNet> teacher,
                       const WeightMap* start)
    : options_(options),
      photos_(photos),
      teacher_(std::move(teacher)),
      random_(options.seed, 1),
      encoder_(NewEncoder(ConvNextConfig(), options.seed)),
      started_(start != nullptr) {
  // Denormal numbers in moments and soft targets make a step four times as slow.
  at::globalContext().setFlushDenormal(true);
  ColorHistogram histogram;
  Random counting(options.seed, 2);
  for (int i = 0; i < kHistogramCrops; ++i) histogram.Add(photos.Crop(32, counting).ab);
  const std::vector<ColorHistogram::Bin> bins =
      start == nullptr ? histogram.Bins(options.min_bin_share) : BinsOf(*start, histogram);
  bins_ = torch::empty({static_cast<int64_t>(bins.size()), 2});
  for (size_t i = 0; i < bins.size(); ++i) {
    bins_[static_cast<int64_t>(i)][0] = bins[i].center_ab[0];
    bins_[static_cast<int64_t>(i)][1] = bins[i].center_ab[1];
  }
  bin_weights_ = torch::tensor(RebalancingWeights(bins, kUniformShare, options.rebalancing_power));
  Random drawing(options.seed, 3);
  head_ = std::make_unique<ColorHead>(encoder_->config(), static_cast<int>(bins.size()), drawing);
  for (const auto& [name, tensor] : encoder_->Parameters()) {
    parameters_.emplace_back("encoder." + name, tensor);
  }
  for (const auto& [name, tensor] : head_->Parameters()) {
    parameters_.emplace_back("color_head." + name, tensor);
  }
  if (start != nullptr) CopyWeights(*start, parameters_);
  const std::vector<int>& dims = encoder_->config().dims;
  match4_ = NewStudentHead("match.4", {128, dims[1], 1, 1});
  match8_ = NewStudentHead("match.8", {256, dims[2], 1, 1});
  match16_ = NewStudentHead("match.16", {512, dims[3] + dims[4], 1, 1});
  match_logits_ = NewStudentHead("match.logits", {1000, dims[4]});
  bins_ = bins_.to(options.device);
  bin_weights_ = bin_weights_.to(options.device);
  if (teacher_) teacher_->MoveTo(options.device);
  for (auto& [name, tensor] : parameters_) {
    tensor.set_data(tensor.to(options.device));  // also in the networks, which share it
    first_.push_back(torch::zeros_like(tensor));
    second_.push_back(torch::zeros_like(tensor));
    average_.push_back(tensor.clone());
    tensor.set_requires_grad(true);
  }
  for (int channels : {128, 256, 512}) {
    teacher_mean_.push_back(torch::zeros({channels}, options.device));
    teacher_deviation_.push_back(torch::ones({channels}, options.device));
  }
}

torch::Tensor Pretrainer::NewStudentHead(const std::string& name, std::vector<int64_t> shape) {
  torch::Tensor tensor = torch::zeros(shape);
  parameters_.emplace_back(name, tensor);
  // A random head would disturb trained weights before it has learned anything.
  if (started_) return tensor;
  Random random(options_.seed, 10 + static_cast<uint64_t>(parameters_.size()));
  const double deviation = std::sqrt(1.0 / static_cast<double>(shape[1]));
  float* values = tensor.data_ptr<float>();
  for (int64_t i = 0; i < tensor.numel(); ++i) {
    values[i] = static_cast<float>(deviation * random.NextNormal());
  }
  return tensor;
}

torch::Tensor Pretrainer::SoftBins(const torch::Tensor& ab) const {
  torch::NoGradGuard no_grad;
  const torch::Tensor cells =
      torch::avg_pool2d(ab, {kCellPx, kCellPx}).permute({0, 2, 3, 1}).reshape({-1, 2});
  // exp(-d^2 / 2 sigma^2), normalised: only the part of d^2 that differs between bins matters.
  const torch::Tensor score = torch::addmm(bins_.square().sum(1).mul(-0.5), cells, bins_.t());
  return torch::softmax(score / (kSoftSigma * kSoftSigma), 1).view({ab.size(0), -1, bins_.size(0)});
}

torch::Tensor Pretrainer::ColorLoss(const torch::Tensor& logits,
                                    const torch::Tensor& colors) const {
  const torch::Tensor target = colors.flatten(0, 1);
  const torch::Tensor rows = logits.permute({0, 2, 3, 1}).reshape({-1, bins_.size(0)});
  return -((target * torch::log_softmax(rows, 1)).sum(1) * target.mv(bin_weights_)).mean();
}

void Pretrainer::Copy(const std::vector<torch::Tensor>& taps,
                      const torch::Tensor& luminance,
                      const torch::Tensor& colors,
                      const std::vector<Image>& matches,
                      torch::Tensor& total,
                      PretrainLosses& losses) {
  const auto pairs = static_cast<int64_t>(matches.size());
  const auto view = [&](int64_t i) {
    CopyView result{{}, luminance.narrow(0, i, 1), colors[i]};
    for (const torch::Tensor& tap : taps) result.taps.push_back(tap.narrow(0, i, 1));
    return result;
  };
  for (int64_t i = 0; i < pairs; ++i) {
    const torch::Tensor places =
        TensorFromImage(matches[i])[0].flatten(1).t().contiguous().to(options_.device);
    const CopyLosses pair = CopyColors(encoder_->config(),
                                       view(i),
                                       view(pairs + i),
                                       places,
                                       bin_weights_,
                                       options_.copying,
                                       random_);
    const double n = static_cast<double>(pairs);
    losses.copy += pair.copy.item<double>() / n;
    losses.contrast += pair.contrast.item<double>() / n;
    total = total + pair.copy * (options_.copy_weight / n) +
            pair.contrast * (options_.contrast_weight / n);
  }
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
    // The teacher does not pad: its cell i lies on the corner between our cells i and i + 1.
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

torch::Tensor Pretrainer::Stack(const std::vector<TrainingCrop>& crops,
                                Image TrainingCrop::*member) const {
  std::vector<torch::Tensor> tensors;
  for (const TrainingCrop& crop : crops) tensors.push_back(TensorFromImage(crop.*member));
  return torch::cat(tensors).to(options_.device);
}

Pretrainer::Batch Pretrainer::NextBatch(double progress) {
  const int size = progress >= 0.5 ? options_.late_size_px : options_.size_px;
  Batch batch;
  if (options_.copy_weight <= 0.0) {
    for (int i = 0; i < options_.batch; ++i) batch.crops.push_back(photos_.Crop(size, random_));
    return batch;
  }
  std::vector<TrainingCrop> second;
  for (int i = 0; i < std::max(1, options_.batch / 2); ++i) {
    TrainingPair pair = photos_.Pair(size, random_);
    batch.crops.push_back(std::move(pair.first));
    second.push_back(std::move(pair.second));
    batch.matches.push_back(std::move(pair.matches));
  }
  std::move(second.begin(), second.end(), std::back_inserter(batch.crops));
  return batch;
}

PretrainLosses Pretrainer::Step(std::optional<double> progress) {
  const double before = std::clamp(
      progress.value_or(static_cast<double>(iteration_) / options_.iterations), 0.0, 1.0);
  const Batch batch = NextBatch(before);
  torch::Tensor total;
  const PretrainLosses losses = Losses(batch, total);
  if (std::isfinite(total.item<double>())) {
    total.backward();
    OptimiserStep(progress ? before : std::min(1.0, (iteration_ + 1.0) / options_.iterations));
    bad_steps_ = 0;
  } else if (++bad_steps_ >= kMaxBadSteps) {
    throw Error(ErrorCode::kInternal,
                "pre-training diverged at iteration {}: lower --learning-rate",
                iteration_);
  }
  ++iteration_;
  return losses;
}

PretrainLosses Pretrainer::Losses(const Batch& batch, torch::Tensor& total) {
  PretrainLosses losses;
  const torch::Tensor luminance = Stack(batch.crops, &TrainingCrop::luminance);
  const torch::Tensor colors = SoftBins(Stack(batch.crops, &TrainingCrop::ab));
  std::vector<torch::Tensor> taps;
  torch::Tensor logits;
  {
    const HalfPrecision half(options_.half_precision);
    taps = encoder_->Taps(encoder_->Input(luminance));
    logits = head_->Forward(taps).to(torch::kFloat32);
  }
  for (torch::Tensor& tap : taps) tap = tap.to(torch::kFloat32);
  total = ColorLoss(logits, colors);
  losses.color = total.item<double>();
  if (teacher_) Distill(taps, Stack(batch.crops, &TrainingCrop::srgb), total, losses);
  if (!batch.matches.empty()) Copy(taps, luminance, colors, batch.matches, total, losses);
  return losses;
}

// AdamW (Loshchilov & Hutter 2019) with clipping, and the running average for release.
void Pretrainer::OptimiserStep(double progress) {
  torch::NoGradGuard no_grad;
  double squares = 0.0;
  for (auto& [name, tensor] : parameters_) {
    if (tensor.grad().defined()) squares += tensor.grad().square().sum().item<double>();
  }
  const double norm = std::sqrt(squares);
  const double t = static_cast<double>(iteration_ + 1);
  const double cosine = 0.5 * (1.0 + std::cos(std::numbers::pi * progress));
  const double common =
      options_.learning_rate * (0.01 + 0.99 * cosine) * std::min(1.0, t / kWarmUp);
  const double clip = std::isfinite(norm) ? std::min(1.0, kMaxGradient / (norm + 1e-12)) : 0.0;
  const double keep = std::min(0.999, (1.0 + t) / (10.0 + t));
  for (size_t i = 0; i < parameters_.size(); ++i) {
    torch::Tensor& tensor = parameters_[i].second;
    const torch::Tensor gradient = tensor.grad();
    const bool fresh = started_ && parameters_[i].first.starts_with("match.");
    const double rate = fresh ? kFreshRate * common : common;
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
  NamedTensors state = State();
  for (auto& [name, tensor] : state) tensor = tensor.detach().cpu();
  PutTensors(state, "", StoredType::kFloat32, &file);
  return WriteTensorFile(file, kFormat);
}

std::string Pretrainer::Restore(std::string_view bytes) {
  const std::string what = "the pre-training checkpoint";
  TensorFile file = ReadTensorFile(bytes, kFormat, what);
  NamedTensors state = State();
  NamedTensors read;  // on the CPU
  for (const auto& [name, tensor] : state) {
    read.emplace_back(name, torch::empty_like(tensor, torch::TensorOptions(torch::kCPU)));
  }
  TakeTensors(read, "", what, &file);
  torch::NoGradGuard no_grad;
  for (size_t i = 0; i < state.size(); ++i) state[i].second.copy_(read[i].second);
  iteration_ = file.facts.at("iteration").get<int64_t>();
  random_ = Random(Random::State{file.facts.at("random_state").get<uint64_t>(),
                                 file.facts.at("random_increment").get<uint64_t>()});
  return file.facts.at("notes").dump();
}

WeightMap Pretrainer::AveragedWeights() const {
  WeightMap weights;
  const auto add = [&weights](const std::string& name, const torch::Tensor& tensor) {
    const torch::Tensor plain = tensor.detach().cpu().contiguous(at::MemoryFormat::Contiguous);
    weights[name] = {
        plain.sizes().vec(),
        std::vector<float>(plain.data_ptr<float>(), plain.data_ptr<float>() + plain.numel())};
  };
  for (size_t i = 0; i < parameters_.size(); ++i) {
    if (!parameters_[i].first.starts_with("match.")) add(parameters_[i].first, average_[i]);
  }
  add("color_bins", bins_);
  add("color_weights", bin_weights_.pow(options_.prior_share));
  return weights;
}

}  // namespace color3d
