#include "core/colorizer/trainer.h"

#include <torch/torch.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/color/difference.h"
#include "core/colorizer/tensor_archive.h"

namespace color3d {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr char kMagic[] = "C3DCKPT1";
constexpr uint32_t kVersion = 1;
constexpr int kGoodStateInterval = 25;
constexpr int kValidationSamples = 2;
constexpr int kReports = 20;  // validation points over the whole schedule
constexpr int kMaxRollbacks = 16;
constexpr double kExplosion = 8.0;  // times the running loss
constexpr double kLossMemory = 0.95;
constexpr int kCropMultiple = 32;
constexpr double kLeastWeightShare = 0.25;  // of a crop's area, in the loss's denominator

int CropFor(const Image& picture, int wanted) {
  const int side = std::min(wanted, std::max(picture.width, picture.height));
  return std::max(kCropMultiple, side / kCropMultiple * kCropMultiple);
}

std::string BytesOf(const Image& image) {
  return {reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float)};
}

}  // namespace

Trainer::Trainer(const std::vector<TrainingPicture>& pictures,
                 const ColorizerOptions& options,
                 const TrainingRecipe& recipe,
                 PersonalModel& model)
    : pictures_(pictures),
      options_(options),
      recipe_(recipe),
      model_(model),
      adam_(model.parameters()),
      random_(options.seed, /*stream=*/1) {
  recipe_.augment.crop_px = CropFor(pictures.front().luminance, options.crop_px);
  AugmentOptions held_out = recipe_.augment;
  held_out.luminance_jitter = 0.0;
  Random validation_random(options.seed, /*stream=*/2);
  for (int i = 0; i < kValidationSamples; ++i) {
    validation_.push_back(Draw(pictures.front(), held_out, validation_random));
  }
}

const TrainingPicture& Trainer::Choose(Random& random) const {
  if (pictures_.size() == 1) return pictures_.front();
  double shares = 0.0;
  for (const TrainingPicture& picture : pictures_) shares += picture.share;
  double place = random.NextUniform() * shares;
  const TrainingPicture* chosen = nullptr;
  for (const TrainingPicture& picture : pictures_) {
    if (picture.share <= 0.0) continue;
    chosen = &picture;
    place -= picture.share;
    if (place < 0.0) break;
  }
  return *chosen;
}

Trainer::Sample Trainer::Draw(const TrainingPicture& picture,
                              const AugmentOptions& options,
                              Random& random) const {
  const AugmentedSample augmented =
      Augment(picture.luminance, picture.ab, picture.weight, options, random);
  const int stride = model_.OutputStride();
  Sample sample;
  sample.luminance = TensorFromImage(augmented.luminance);
  sample.ab = torch::avg_pool2d(TensorFromImage(augmented.ab), {stride, stride}) / kAbScale;
  sample.weight = torch::avg_pool2d(TensorFromImage(augmented.valid), {stride, stride});
  return sample;
}

torch::Tensor Trainer::Loss(const Sample& sample) const {
  const torch::Tensor predicted = model_.Forward(sample.luminance);
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

double Trainer::Progress() const {
  if (options_.iterations == 0) return 1.0;
  double share = static_cast<double>(iteration_) / options_.iterations;
  if (options_.time_limit_seconds > 0.0) {
    share = std::max(share, seconds_ / options_.time_limit_seconds);
  }
  return std::min(share, 1.0);
}

double Trainer::LearningRate() const {
  const double cosine = 0.5 * (1.0 + std::cos(std::numbers::pi * Progress()));
  const double warmup = std::min(
      1.0, static_cast<double>(adam_.steps() + 1) / std::max(recipe_.warmup_iterations, 1));
  return learning_rate_scale_ * warmup *
         (recipe_.last_learning_rate +
          (recipe_.first_learning_rate - recipe_.last_learning_rate) * cosine);
}

bool Trainer::Iterate() {
  const Sample sample = Draw(Choose(random_), recipe_.augment, random_);
  const torch::Tensor loss = Loss(sample);
  const double value = loss.item<double>();
  if (!std::isfinite(value)) return false;
  if (running_loss_ > 0.0 && value > kExplosion * running_loss_) return false;
  loss.backward();
  if (!std::isfinite(adam_.Step(LearningRate(), recipe_.max_gradient_norm))) return false;
  running_loss_ =
      running_loss_ > 0.0 ? kLossMemory * running_loss_ + (1.0 - kLossMemory) * value : value;
  return true;
}

void Trainer::KeepGoodState() {
  good_state_.clear();
  for (const auto& [name, tensor] : model_.parameters()) {
    good_state_.push_back(tensor.detach().clone());
  }
  for (const auto& [name, tensor] : adam_.Moments()) good_state_.push_back(tensor.clone());
  good_steps_ = adam_.steps();
  good_running_loss_ = running_loss_;
}

void Trainer::RollBack(ProgressObserver& progress) {
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
  adam_.set_steps(good_steps_);
  running_loss_ = good_running_loss_;
  learning_rate_scale_ *= 0.5;
  progress.OnWarning("personalization: the loss exploded at iteration " +
                     std::to_string(iteration_) + "; went back to the last good state with " +
                     std::to_string(learning_rate_scale_) + " of the learning rate");
}

double Trainer::ValidationDeltaE00() const {
  torch::NoGradGuard no_grad;
  double sum = 0.0;
  double weight_sum = 0.0;
  const int stride = model_.OutputStride();
  for (const Sample& sample : validation_) {
    const Image l = ImageFromTensor(torch::avg_pool2d(sample.luminance, {stride, stride}));
    const Image predicted = ImageFromTensor(model_.Forward(sample.luminance) * kAbScale);
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

void Trainer::Report(ProgressObserver& progress) {
  TrainingPoint point;
  point.iteration = iteration_;
  point.seconds = seconds_;
  point.train_l1_ab = running_loss_ * kAbScale;
  point.validation_delta_e00 = ValidationDeltaE00();
  curve_.push_back(point);
  progress.OnError(iteration_, "train_l1_ab", point.train_l1_ab);
  progress.OnError(iteration_, "validation_delta_e00", point.validation_delta_e00);
}

void Trainer::Run(CheckpointStore& checkpoints,
                  ProgressObserver& progress,
                  const CancellationToken& cancel) {
  if (const std::optional<std::string> state = checkpoints.Load()) {
    try {
      LoadState(*state);
    } catch (const Error& error) {
      progress.OnWarning(std::string("personalization starts afresh: ") + error.what());
    }
  }
  const double seconds_before = seconds_;
  const Clock::time_point start = Clock::now();
  KeepGoodState();
  while (Progress() < 1.0) {
    cancel.ThrowIfCancelled();
    if (!Iterate()) RollBack(progress);
    ++iteration_;  // also after a rollback: the sample is spent, the schedule goes on
    seconds_ = seconds_before + std::chrono::duration<double>(Clock::now() - start).count();
    progress.OnProgress(iteration_, options_.iterations, "personalizing the colorizer");
    if (iteration_ % kGoodStateInterval == 0) {
      KeepGoodState();
      if (checkpoints.WantsSave()) checkpoints.Save(SaveState());
    }
    if (Progress() * kReports >= static_cast<double>(curve_.size())) Report(progress);
  }
}

std::string Trainer::Fingerprint() const {
  Sha256 hash;
  for (const TrainingPicture& picture : pictures_) {
    hash.Update(Json{picture.luminance.width, picture.luminance.height, picture.share}.dump());
    hash.Update(BytesOf(picture.luminance));
    hash.Update(BytesOf(picture.ab));
    hash.Update(BytesOf(picture.weight));
  }
  hash.Update(Json{static_cast<int>(options_.recipe),
                   options_.iterations,
                   options_.time_limit_seconds,
                   options_.crop_px,
                   options_.consistency_weight,
                   options_.seed}
                  .dump());
  hash.Update(model_.EncoderDigest());
  return hash.FinishHex();
}

std::string Trainer::SaveState() const {
  Json header{{"fingerprint", Fingerprint()},
              {"iteration", iteration_},
              {"seconds", seconds_},
              {"learning_rate_scale", learning_rate_scale_},
              {"running_loss", running_loss_},
              {"rollbacks", rollbacks_},
              {"steps", adam_.steps()},
              {"random", {random_.state().state, random_.state().increment}},
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
  return WriteArchive(archive, kMagic);
}

void Trainer::LoadState(const std::string& state) {
  const std::string what = "the checkpoint";
  Archive archive = ReadArchive(state, kMagic, kVersion, what);
  try {
    const Json header = Json::parse(archive.header);
    if (header.at("fingerprint") != Fingerprint()) {
      throw InvalidArgument("the checkpoint belongs to other options or other pictures");
    }
    // TakeTensors checks each array before it copies; the fingerprint has already told us that
    // they belong to this model, so nothing is half restored.
    TakeTensors(model_.parameters(), "", what, archive);
    TakeTensors(model_.statistics(), "", what, archive);
    TakeTensors(adam_.Moments(), "", what, archive);
    iteration_ = header.at("iteration");
    seconds_ = header.at("seconds");
    learning_rate_scale_ = header.at("learning_rate_scale");
    running_loss_ = header.at("running_loss");
    rollbacks_ = header.at("rollbacks");
    adam_.set_steps(header.at("steps"));
    random_ = Random(Random::State{header.at("random").at(0), header.at("random").at(1)});
    for (const Json& point : header.at("curve")) {
      curve_.push_back({point.at(0), point.at(1), point.at(2), point.at(3)});
    }
  } catch (const Json::exception& error) {
    throw InvalidArgument(what + " has a damaged header: " + error.what());
  }
}

}  // namespace color3d
