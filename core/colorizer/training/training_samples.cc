#include "core/colorizer/training/training_samples.h"

#include <torch/types.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/digest.h"
#include "core/colorizer/training/view_change.h"
#include "core/encoder/image_tensors.h"

namespace color3d {
namespace {

constexpr int kHeldOutSamples = 2;
constexpr int kCropMultiple = 32;

int CropFor(const Image& picture, int wanted) {
  const int side = std::min(wanted, std::max(picture.width, picture.height));
  return std::max(kCropMultiple, side / kCropMultiple * kCropMultiple);
}

constexpr uint64_t kSeedStep = 0x9e3779b97f4a7c15ULL;  // increment of SplitMix64

std::string_view ImageBytes(const Image& image) {
  return {reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float)};
}

}  // namespace

TrainingSamples::TrainingSamples(const std::vector<TrainingPicture>& pictures,
                                 const AugmentOptions& augment,
                                 const ColorizerOptions& options,
                                 const PersonalModel& model)
    : pictures_(pictures), model_(model), augment_(augment), seed_(options.seed) {
  augment_.crop_px = CropFor(pictures.front().luminance, options.crop_px);
  AugmentOptions held_out = augment_;
  held_out.luminance_jitter = 0.0;
  Random random(seed_, /*stream=*/2);
  for (int i = 0; i < kHeldOutSamples; ++i) {
    held_out_.push_back(Make(pictures_.front(), held_out, random));
  }
}

const TrainingPicture& TrainingSamples::Choose(Random& random) const {
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

TrainingSample TrainingSamples::Make(const TrainingPicture& picture,
                                     const AugmentOptions& options,
                                     Random& random) const {
  torch::NoGradGuard no_grad;
  const AugmentedSample augmented =
      Augment(picture.luminance, picture.ab, picture.weight, options, random);
  const int stride = model_.OutputStride();
  TrainingSample sample;
  sample.luminance = TensorFromImage(augmented.luminance);
  sample.ab = torch::avg_pool2d(TensorFromImage(augmented.ab), {stride, stride}) / kAbScale;
  sample.weight = torch::avg_pool2d(TensorFromImage(augmented.valid), {stride, stride});
  if (!model_.config().HasAdapters()) sample.taps = model_.Taps(sample.luminance);
  return sample;
}

TrainingSample TrainingSamples::Draw(int64_t number) const {
  Random random(MixedBits(seed_ + kSeedStep * static_cast<uint64_t>(number)), /*stream=*/1);
  const TrainingPicture& picture = Choose(random);
  return Make(picture, augment_, random);
}

ChangedSample TrainingSamples::Change(const TrainingSample& sample, int64_t number) const {
  torch::NoGradGuard no_grad;
  Random random(MixedBits(seed_ + kSeedStep * static_cast<uint64_t>(number)), /*stream=*/4);
  const ViewChange change = ViewChange::Draw(random);
  const auto grid = [&change](const torch::Tensor& picture) {
    const int64_t height = picture.size(2), width = picture.size(3);
    return SamplingGrid(change.Positions(height, width), height, width);
  };
  ChangedSample changed;
  changed.luminance =
      change.InLight(Warp(sample.luminance, grid(sample.luminance), Border::kReflect));
  changed.grid = grid(sample.weight);
  changed.weight = Warp(sample.weight, changed.grid, Border::kZero);
  if (!model_.config().HasAdapters()) changed.taps = model_.Taps(changed.luminance);
  return changed;
}

std::string TrainingSamples::Digest() const {
  Sha256 hash;
  for (const TrainingPicture& picture : pictures_) {
    hash.Update(
        nlohmann::json{picture.luminance.width, picture.luminance.height, picture.share}.dump());
    for (const Image* map : {&picture.luminance, &picture.ab, &picture.weight}) {
      hash.Update(ImageBytes(*map));
    }
  }
  return hash.FinishHex();
}

}  // namespace color3d
