#include "core/colorizer/training_session.h"

#include <torch/torch.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/base/error.h"
#include "core/base/flush_to_zero.h"
#include "core/color/difference.h"
#include "core/colorizer/options_json.h"
#include "core/colorizer/tensor_archive.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_threads.h"

namespace color3d {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr char kMagic[] = "C3DCKPT1";
constexpr uint32_t kVersion = 2;
constexpr int kReports = 20;  // validation points over the whole schedule
constexpr int kMaxRollbacks = 16;
constexpr double kExplosion = 8.0;  // of one loss, times the running loss
constexpr double kDrift = 3.0;      // of the running loss, times its best
constexpr double kDriftFloor = 3.0 / kAbScale;
constexpr double kLossMemory = 0.95;
constexpr double kLeastWeightShare = 0.25;  // of a crop's area, in the loss's denominator
constexpr char kAverage[] = "average.";

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

torch::Tensor TrainingSession::Predict(const TrainingSample& sample) const {
  return sample.taps.empty() ? model_.Forward(sample.luminance)
                             : model_.Decode(sample.taps, sample.luminance);
}

torch::Tensor TrainingSession::Loss(const TrainingSample& sample) const {
  const torch::Tensor predicted = Predict(sample);
  // A crop with little to learn from counts little, instead of shouting as loud as a full one.
  const double area = static_cast<double>(sample.weight.numel());
  const double total = 2.0 * std::max(sample.weight.sum().item<double>(), kLeastWeightShare * area);
  torch::Tensor loss = ((predicted - sample.ab).abs() * sample.weight).sum() / total;
  if (options_.consistency_weight > 0.0) {
    // The paper's A4: two augmentations of one picture must agree where they show the same point.
    // The second one is the mirror image, which maps back without interpolation.
    const torch::Tensor mirrored = model_.Forward(sample.luminance.flip({3})).flip({3});
    loss = loss + options_.consistency_weight *
                      (((predicted - mirrored).square() * sample.weight).sum() / total);
  }
  return loss;
}

double TrainingSession::Progress() const {
  if (options_.iterations == 0) return 1.0;
  double share = static_cast<double>(iteration_) / options_.iterations;
  if (options_.time_limit_seconds > 0.0) {
    share = std::max(share, seconds_ / options_.time_limit_seconds);
  }
  return std::min(share, 1.0);
}

double TrainingSession::LearningRate() const {
  const double cosine = 0.5 * (1.0 + std::cos(std::numbers::pi * Progress()));
  const double warmup = std::min(
      1.0, static_cast<double>(adam_.steps() + 1) / std::max(recipe_.warmup_iterations, 1));
  return learning_rate_scale_ * warmup *
         (recipe_.last_learning_rate +
          (recipe_.first_learning_rate - recipe_.last_learning_rate) * cosine);
}

bool TrainingSession::TrainOn(const TrainingSample& sample) {
  const torch::Tensor loss = Loss(sample);
  const double value = loss.item<double>();
  if (!std::isfinite(value)) return false;
  if (running_loss_ > 0.0 && value > kExplosion * running_loss_ + kDriftFloor) return false;
  loss.backward();
  if (!std::isfinite(adam_.Step(LearningRate(), recipe_.max_gradient_norm))) return false;
  running_loss_ =
      running_loss_ > 0.0 ? kLossMemory * running_loss_ + (1.0 - kLossMemory) * value : value;
  if (HasDrifted()) return false;
  if (best_running_loss_ == 0.0 || running_loss_ < best_running_loss_) {
    best_running_loss_ = running_loss_;
  }
  UpdateAverage();
  return true;
}

// Divergence without any single step that explodes.
bool TrainingSession::HasDrifted() const {
  return best_running_loss_ > 0.0 && running_loss_ > kDrift * best_running_loss_ + kDriftFloor;
}

// Exponential mean of the parameters; younger at the beginning, so that the random start is soon
// forgotten.
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

// In 16 bits, as it would otherwise be half of what a waiting scene keeps in memory: parameters
// with the precision in which they are delivered, moments with float32's range.
void TrainingSession::KeepGoodState() {
  torch::NoGradGuard no_grad;
  good_state_.clear();
  const auto keep = [this](const NamedTensors& tensors, torch::ScalarType type) {
    for (const auto& [name, tensor] : tensors) good_state_.push_back(tensor.to(type));
  };
  keep(model_.parameters(), torch::kHalf);
  keep(adam_.Moments(), torch::kBFloat16);
  keep(Average(), torch::kHalf);
  good_steps_ = adam_.steps();
  good_running_loss_ = running_loss_;
}

void TrainingSession::RollBack(ProgressObserver& progress) {
  if (++rollbacks_ > kMaxRollbacks) {
    throw Error(ErrorCode::kInternal,
                "personalization diverged " + std::to_string(rollbacks_) +
                    " times even with smaller steps; try another key view or another seed");
  }
  torch::NoGradGuard no_grad;
  size_t next = 0;
  auto restore = [&](const NamedTensors& tensors) {
    for (const auto& [name, tensor] : tensors) {
      torch::Tensor target = tensor;
      target.copy_(good_state_[next++]);
      target.mutable_grad() = torch::Tensor();
    }
  };
  restore(model_.parameters());
  restore(adam_.Moments());
  restore(Average());
  adam_.set_steps(good_steps_);
  running_loss_ = good_running_loss_;
  best_running_loss_ = good_running_loss_;
  learning_rate_scale_ *= 0.5;
  progress.OnWarning("personalization: the loss exploded at iteration " +
                     std::to_string(iteration_) + "; went back to the last good state with " +
                     std::to_string(learning_rate_scale_) + " of the learning rate");
}

double TrainingSession::ValidationDeltaE00() const {
  torch::NoGradGuard no_grad;
  double sum = 0.0;
  double weight_sum = 0.0;
  const int stride = model_.OutputStride();
  for (const TrainingSample& sample : samples_.held_out()) {
    const Image l = ImageFromTensor(torch::avg_pool2d(sample.luminance, {stride, stride}));
    const Image predicted = ImageFromTensor(Predict(sample) * kAbScale);
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
  point.iteration = iteration_;
  point.seconds = seconds_;
  point.train_l1_ab = running_loss_ * kAbScale;
  // Of what would be delivered.
  if (!average_.empty()) SwapWithAverage();
  point.validation_delta_e00 = ValidationDeltaE00();
  if (!average_.empty()) SwapWithAverage();
  curve_.push_back(point);
  progress.OnError(iteration_, "train_l1_ab", point.train_l1_ab);
  progress.OnError(iteration_, "validation_delta_e00", point.validation_delta_e00);
  stopped_early_ = early_stop_.Add(point.validation_delta_e00) && Progress() < 1.0;
}

void TrainingSession::Step(ProgressObserver& progress, ThreadPool* helpers) {
  const Clock::time_point start = Clock::now();
  const TrainingSample sample = next_ ? std::move(*next_) : samples_.Draw(iteration_);
  next_.reset();
  bool learned = false;
  const auto part = [&](int64_t index, int) {
    const ScopedFlushToZero flush;
    SetTorchThreads(1);
    if (index == 0) {
      learned = TrainOn(sample);
    } else {
      next_ = samples_.Draw(iteration_ + 1);
    }
  };
  if (helpers != nullptr) {
    helpers->ForEach(2, part);
  } else {
    part(0, 0);
  }
  if (!learned) RollBack(progress);
  ++iteration_;  // also after a rollback: the sample is spent, the schedule goes on
  seconds_ += std::chrono::duration<double>(Clock::now() - start).count();
  progress.OnProgress(iteration_, options_.iterations, "personalizing the colorizer");
  if (iteration_ % kGoodStateInterval == 0) KeepGoodState();
  if (Progress() * kReports >= static_cast<double>(curve_.size())) Report(progress);
}

void TrainingSession::Conclude(ProgressObserver& progress) {
  if (stopped_early_) progress.OnError(iteration_, "stopped_early_iteration", iteration_);
  if (average_.empty() || iteration_ == 0) return;
  const double last = ValidationDeltaE00();
  SwapWithAverage();
  if (last < ValidationDeltaE00()) SwapWithAverage();
}

void TrainingSession::Resume(const std::optional<std::string>& state, ProgressObserver& progress) {
  if (!state) return;
  try {
    LoadState(*state);
    KeepGoodState();
  } catch (const Error& error) {
    progress.OnWarning(std::string("personalization starts afresh: ") + error.what());
  }
}

std::string TrainingSession::Checkpoint() const {
  Json header{{"pictures", samples_.Digest()},
              {"encoder", model_.EncoderDigest()},
              {"options", JsonFromOptions(options_)},
              {"iteration", iteration_},
              {"seconds", seconds_},
              {"learning_rate_scale", learning_rate_scale_},
              {"running_loss", running_loss_},
              {"best_running_loss", best_running_loss_},
              {"rollbacks", rollbacks_},
              {"stopped_early", stopped_early_},
              {"steps", adam_.steps()},
              {"curve", Json::array()}};
  for (const TrainingPoint& point : curve_) {
    header["curve"].push_back(
        {point.iteration, point.seconds, point.train_l1_ab, point.validation_delta_e00});
  }
  Archive archive;
  archive.version = kVersion;
  archive.header = header.dump();
  PutTensors(model_.parameters(), "", ArchiveArray::Type::kFloat32, archive);
  PutTensors(model_.statistics(), "", ArchiveArray::Type::kFloat32, archive);
  PutTensors(adam_.Moments(), "", ArchiveArray::Type::kFloat32, archive);
  PutTensors(Average(), kAverage, ArchiveArray::Type::kFloat32, archive);
  return WriteArchive(archive, kMagic);
}

NamedTensors TrainingSession::Average() const {
  NamedTensors named;
  for (size_t i = 0; i < average_.size(); ++i) {
    named.emplace_back(model_.parameters()[i].first, average_[i]);
  }
  return named;
}

void TrainingSession::LoadState(const std::string& state) {
  const std::string what = "the checkpoint";
  Archive archive = ReadArchive(state, kMagic, kVersion, what);
  try {
    const Json header = Json::parse(archive.header);
    if (header.at("pictures") != samples_.Digest() ||
        header.at("encoder") != model_.EncoderDigest() ||
        header.at("options") != JsonFromOptions(options_)) {
      throw InvalidArgument("the checkpoint belongs to other options or other pictures");
    }
    // TakeTensors checks each array before it copies; the digests have already told us that they
    // belong to this model, so nothing is half restored.
    TakeTensors(model_.parameters(), "", what, archive);
    TakeTensors(model_.statistics(), "", what, archive);
    TakeTensors(adam_.Moments(), "", what, archive);
    TakeTensors(Average(), kAverage, what, archive);
    iteration_ = header.at("iteration");
    seconds_ = header.at("seconds");
    learning_rate_scale_ = header.at("learning_rate_scale");
    running_loss_ = header.at("running_loss");
    best_running_loss_ = header.at("best_running_loss");
    rollbacks_ = header.at("rollbacks");
    stopped_early_ = header.at("stopped_early");
    adam_.set_steps(header.at("steps"));
    for (const Json& point : header.at("curve")) {
      curve_.push_back({point.at(0), point.at(1), point.at(2), point.at(3)});
      early_stop_.Add(curve_.back().validation_delta_e00);
    }
  } catch (const Json::exception& error) {
    throw InvalidArgument(what + " has a damaged header: " + error.what());
  }
}

}  // namespace color3d
