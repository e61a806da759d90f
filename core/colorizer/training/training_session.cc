#include "core/colorizer/training/training_session.h"

#include <fmt/format.h>
#include <torch/types.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/base/error.h"
#include "core/base/flush_to_zero.h"
#include "core/color/difference.h"
#include "core/colorizer/model/named_tensors.h"
#include "core/colorizer/training/options_json.h"
#include "core/colorizer/training/view_change.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_threads.h"

namespace color3d {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kWhat[] = "the checkpoint";
constexpr int kReports = 20;  // number of validation points in the schedule
constexpr int kMaxRollbacks = 16;
constexpr double kExplosion = 8.0;  // ratio of a loss to the running loss
constexpr double kDrift = 3.0;      // ratio of the running loss to its best
constexpr double kDriftFloor = 3.0 / kAbScale;
constexpr double kLossMemory = 0.95;
constexpr double kMinWeightShare =
    0.25;  // minimum share of a crop's area in the denominator of the loss
constexpr char kAverage[] = "average.";

// Mean of two channels. A crop with few valid pixels counts less than a full one.
torch::Tensor WeightedMean(const torch::Tensor& values, const torch::Tensor& weight) {
  const double area = static_cast<double>(weight.numel());
  const double total = 2.0 * std::max(weight.sum().item<double>(), kMinWeightShare * area);
  return (values * weight).sum() / total;
}

}  // namespace

TrainingSession::TrainingSession(const std::vector<TrainingPicture>& pictures,
                                 const ColorizerOptions& options,
                                 const TrainingRecipe& recipe,
                                 PersonalModel& model)
    : options_(options),
      recipe_(recipe),
      model_(model),
      samples_(pictures, recipe.augment, options, model),
      adam_(model.parameters()),
      early_stop_({.min_improvement = options.min_improvement}) {
  if (options_.average_decay > 0.0) {
    for (const auto& [name, tensor] : model_.parameters()) {
      average_.push_back(tensor.detach().clone());
    }
  }
  KeepGoodState();
}

torch::Tensor TrainingSession::Predict(const std::vector<torch::Tensor>& taps,
                                       const torch::Tensor& luminance) const {
  return taps.empty() ? model_.Forward(luminance) : model_.Decode(taps, luminance);
}

torch::Tensor TrainingSession::Loss(const TrainingSample& sample) const {
  const torch::Tensor predicted = Predict(sample.taps, sample.luminance);
  const torch::Tensor loss = WeightedMean((predicted - sample.ab).abs(), sample.weight);
  if (options_.consistency_weight <= 0.0) return loss;
  return loss + options_.consistency_weight * Inconsistency(predicted, sample);
}

torch::Tensor TrainingSession::Inconsistency(const torch::Tensor& predicted,
                                             const TrainingSample& sample) const {
  const ChangedSample changed = samples_.Change(sample, course_.iteration);
  const torch::Tensor again = Predict(changed.taps, changed.luminance);
  const torch::Tensor before = Warp(predicted, changed.grid, Border::kRepeat);
  return WeightedMean((again - before).square(), changed.weight);
}

double TrainingSession::Progress() const {
  if (options_.iterations == 0) return 1.0;
  double share = static_cast<double>(course_.iteration) / options_.iterations;
  if (options_.time_limit_seconds > 0.0) {
    share = std::max(share, course_.seconds / options_.time_limit_seconds);
  }
  return std::min(share, 1.0);
}

double TrainingSession::LearningRate() const {
  const double cosine = 0.5 * (1.0 + std::cos(std::numbers::pi * Progress()));
  const double warmup = std::min(
      1.0, static_cast<double>(adam_.steps() + 1) / std::max(recipe_.warmup_iterations, 1));
  return course_.learning_rate_scale * warmup *
         (recipe_.last_learning_rate +
          (recipe_.first_learning_rate - recipe_.last_learning_rate) * cosine);
}

bool TrainingSession::TrainOn(const TrainingSample& sample) {
  const torch::Tensor loss = Loss(sample);
  const double value = loss.item<double>();
  if (!std::isfinite(value)) return false;
  if (course_.running_loss > 0.0 && value > kExplosion * course_.running_loss + kDriftFloor)
    return false;
  loss.backward();
  if (!std::isfinite(adam_.Step(LearningRate(), options_.max_gradient_norm))) return false;
  course_.running_loss = course_.running_loss > 0.0
                             ? kLossMemory * course_.running_loss + (1.0 - kLossMemory) * value
                             : value;
  if (HasDrifted()) return false;
  if (course_.best_running_loss == 0.0 || course_.running_loss < course_.best_running_loss) {
    course_.best_running_loss = course_.running_loss;
  }
  UpdateAverage();
  return true;
}

// Detects divergence without a single exploding step.
bool TrainingSession::HasDrifted() const {
  return course_.best_running_loss > 0.0 &&
         course_.running_loss > kDrift * course_.best_running_loss + kDriftFloor;
}

// Exponential moving average of the parameters. The decay is smaller at the beginning, so that the
// random start is soon forgotten.
void TrainingSession::UpdateAverage() {
  if (average_.empty()) return;
  torch::NoGradGuard no_grad;
  const double steps = static_cast<double>(adam_.steps());
  const double decay = std::min(options_.average_decay, steps / (steps + 9.0));
  size_t next = 0;
  for (const auto& [name, tensor] : model_.parameters()) {
    average_[next++].lerp_(tensor, 1.0 - decay);
  }
}

void TrainingSession::SwapWithAverage() {
  torch::NoGradGuard no_grad;
  size_t next = 0;
  for (const auto& [name, tensor] : model_.parameters()) {
    const torch::Tensor kept = tensor.clone();
    torch::Tensor target = tensor;
    target.copy_(average_[next]);
    average_[next++].copy_(kept);
  }
}

// Stored in 16 bits, since it would otherwise be half of the memory of a waiting scene: parameters
// as float16, as in colorizer files; moments as bfloat16, for its range.
void TrainingSession::KeepGoodState() {
  torch::NoGradGuard no_grad;
  good_.tensors.clear();
  const auto keep = [this](const NamedTensors& tensors, torch::ScalarType type) {
    for (const auto& [name, tensor] : tensors) good_.tensors.push_back(tensor.to(type));
  };
  keep(model_.parameters(), torch::kHalf);
  keep(adam_.Moments(), torch::kBFloat16);
  keep(Average(), torch::kHalf);
  good_.steps = adam_.steps();
  good_.running_loss = course_.running_loss;
}

void TrainingSession::RollBack(ProgressObserver& progress) {
  if (++course_.rollbacks > kMaxRollbacks) {
    throw Error(
        ErrorCode::kInternal,
        "personalization diverged {} times in spite of smaller steps; try another key view or seed",
        course_.rollbacks);
  }
  torch::NoGradGuard no_grad;
  size_t next = 0;
  auto restore = [&](const NamedTensors& tensors) {
    for (const auto& [name, tensor] : tensors) {
      torch::Tensor target = tensor;
      target.copy_(good_.tensors[next++]);
      target.mutable_grad() = torch::Tensor();
    }
  };
  restore(model_.parameters());
  restore(adam_.Moments());
  restore(Average());
  adam_.set_steps(good_.steps);
  course_.running_loss = good_.running_loss;
  course_.best_running_loss = good_.running_loss;
  course_.learning_rate_scale *= 0.5;
  progress.OnWarning(
      fmt::format("personalization: the loss diverged at iteration {}; training continues from the "
                  "last good state with {} of the learning rate",
                  course_.iteration,
                  course_.learning_rate_scale));
}

double TrainingSession::HeldOutError() const {
  return HeldOutError(
      [&](const TrainingSample& sample) { return Predict(sample.taps, sample.luminance); });
}

double TrainingSession::HeldOutError(
    const std::function<torch::Tensor(const TrainingSample& sample)>& predict) const {
  torch::NoGradGuard no_grad;
  double sum = 0.0;
  double weight_sum = 0.0;
  const int stride = model_.OutputStride();
  for (const TrainingSample& sample : samples_.held_out()) {
    const Image l = ImageFromTensor(torch::avg_pool2d(sample.luminance, {stride, stride}));
    const Image predicted = ImageFromTensor(predict(sample) * kAbScale);
    const Image truth = ImageFromTensor(sample.ab * kAbScale);
    const Image weight = ImageFromTensor(sample.weight);
    for (size_t i = 0; i < l.PlaneSize(); ++i) {
      if (weight.data[i] < 1.0f) continue;
      sum += DeltaE00({l.data[i], predicted.Plane(0)[i], predicted.Plane(1)[i]},
                      {l.data[i], truth.Plane(0)[i], truth.Plane(1)[i]});
      weight_sum += 1.0;
    }
  }
  return weight_sum > 0.0 ? sum / weight_sum : 0.0;
}

void TrainingSession::Report(ProgressObserver& progress) {
  TrainingPoint point;
  point.iteration = course_.iteration;
  point.seconds = course_.seconds;
  point.train_l1_ab = course_.running_loss * kAbScale;
  // Error of the parameters that would be returned now.
  if (!average_.empty()) SwapWithAverage();
  point.validation_delta_e00 = HeldOutError();
  if (!average_.empty()) SwapWithAverage();
  course_.curve.push_back(point);
  progress.OnError(course_.iteration, "train_l1_ab", point.train_l1_ab);
  progress.OnError(course_.iteration, "validation_delta_e00", point.validation_delta_e00);
  course_.stopped_early = early_stop_.Add(point.validation_delta_e00) && Progress() < 1.0;
}

void TrainingSession::Step(ProgressObserver& progress, ThreadPool* helpers) {
  const Clock::time_point start = Clock::now();
  const TrainingSample sample = next_ ? std::move(*next_) : samples_.Draw(course_.iteration);
  next_.reset();
  bool learned = false;
  const auto part = [&](int64_t index, int) {
    const ScopedFlushToZero flush;
    SetTorchThreads(1);
    if (index == 0) {
      learned = TrainOn(sample);
    } else {
      next_ = samples_.Draw(course_.iteration + 1);
    }
  };
  if (helpers != nullptr) {
    helpers->ForEach(2, part);
  } else {
    part(0, 0);
  }
  if (!learned) RollBack(progress);
  ++course_.iteration;  // also after a rollback: sample and schedule advance
  course_.seconds += std::chrono::duration<double>(Clock::now() - start).count();
  progress.OnProgress(course_.iteration, options_.iterations, "personalizing the colorizer");
  if (course_.iteration % kGoodStateInterval == 0) KeepGoodState();
  if (Progress() * kReports >= static_cast<double>(course_.curve.size())) Report(progress);
}

void TrainingSession::KeepBetterParameters(ProgressObserver& progress) {
  if (course_.stopped_early)
    progress.OnError(course_.iteration, "stopped_early_iteration", course_.iteration);
  if (average_.empty() || course_.iteration == 0) return;
  const double last = HeldOutError();
  SwapWithAverage();
  if (last < HeldOutError()) SwapWithAverage();
}

void TrainingSession::Resume(const std::optional<std::string>& state, ProgressObserver& progress) {
  if (!state) return;
  try {
    LoadState(*state);
    KeepGoodState();
  } catch (const Error& error) {
    progress.OnWarning(
        fmt::format("personalization restarts from the beginning: {}", error.what()));
  }
}

std::string TrainingSession::Checkpoint() const {
  TensorFile file;
  file.facts = {{"pictures", samples_.Digest()},
                {"encoder", model_.EncoderDigest()},
                {"options", JsonFromOptions(options_)},
                {"iteration", course_.iteration},
                {"seconds", course_.seconds},
                {"learning_rate_scale", course_.learning_rate_scale},
                {"running_loss", course_.running_loss},
                {"best_running_loss", course_.best_running_loss},
                {"rollbacks", course_.rollbacks},
                {"stopped_early", course_.stopped_early},
                {"steps", adam_.steps()},
                {"curve", JsonFromCurve(course_.curve)}};
  PutTensors(model_.parameters(), "", StoredType::kFloat32, &file);
  PutTensors(model_.statistics(), "", StoredType::kFloat32, &file);
  PutTensors(adam_.Moments(), "", StoredType::kFloat32, &file);
  PutTensors(Average(), kAverage, StoredType::kFloat32, &file);
  return WriteTensorFile(file, kCheckpointFormat);
}

NamedTensors TrainingSession::Average() const {
  NamedTensors named;
  for (size_t i = 0; i < average_.size(); ++i) {
    named.emplace_back(model_.parameters()[i].first, average_[i]);
  }
  return named;
}

void TrainingSession::LoadState(const std::string& state) {
  TensorFile file = ReadTensorFile(state, kCheckpointFormat, kWhat);
  const nlohmann::json& facts = file.facts;
  try {
    if (facts.at("pictures") != samples_.Digest() ||
        facts.at("encoder") != model_.EncoderDigest() ||
        facts.at("options") != JsonFromOptions(options_)) {
      throw InvalidArgument("{} belongs to other options or other pictures", kWhat);
    }
    // TakeTensors checks each array before it copies. The digests match, so the arrays belong to
    // this model and no partial restore can occur.
    TakeTensors(model_.parameters(), "", kWhat, &file);
    TakeTensors(model_.statistics(), "", kWhat, &file);
    TakeTensors(adam_.Moments(), "", kWhat, &file);
    TakeTensors(Average(), kAverage, kWhat, &file);
    course_ = {.iteration = facts.at("iteration"),
               .seconds = facts.at("seconds"),
               .learning_rate_scale = facts.at("learning_rate_scale"),
               .running_loss = facts.at("running_loss"),
               .best_running_loss = facts.at("best_running_loss"),
               .rollbacks = facts.at("rollbacks"),
               .stopped_early = facts.at("stopped_early"),
               .curve = CurveFromJson(facts.at("curve"))};
    adam_.set_steps(facts.at("steps"));
    for (const TrainingPoint& point : course_.curve) early_stop_.Add(point.validation_delta_e00);
  } catch (const nlohmann::json::exception& error) {
    throw InvalidArgument("{} has a damaged header: {}", kWhat, error.what());
  }
}

}  // namespace color3d
