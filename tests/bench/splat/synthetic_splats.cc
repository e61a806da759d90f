#include "tests/bench/splat/synthetic_splats.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {

constexpr int kCoefficients = 16;
constexpr double kMeanDepth = 4.0;
const float kBlack[4] = {0.0f, 0.0f, 0.0f, 0.0f};

ParameterBlock RandomGaussians(const SyntheticLoad& load, const RasterCamera& camera) {
  Random random(1);
  ParameterBlock p(kColorRow + kCoefficients * load.channels, load.gaussians);
  const double pixels = static_cast<double>(load.width_px) * load.height_px;
  const double sigma_px = std::max(0.7, 0.9 * std::sqrt(pixels / load.gaussians));
  for (int i = 0; i < load.gaussians; ++i) {
    const double z = random.NextUniform(0.5, 1.5) * kMeanDepth;
    p.Row(kPositionRow)[i] =
        static_cast<float>(z * random.NextUniform(-0.55, 0.55) * load.width_px / camera.fx);
    p.Row(kPositionRow + 1)[i] =
        static_cast<float>(z * random.NextUniform(-0.55, 0.55) * load.height_px / camera.fy);
    p.Row(kPositionRow + 2)[i] = static_cast<float>(z);
    for (int k = 0; k < 3; ++k) {
      p.Row(kLogScaleRow + k)[i] = static_cast<float>(std::log(sigma_px * kMeanDepth / camera.fx) +
                                                      0.5 * random.NextNormal());
    }
    for (int k = 0; k < 4; ++k) {
      p.Row(kRotationRow + k)[i] = static_cast<float>(random.NextNormal());
    }
    p.Row(kOpacityRow)[i] = static_cast<float>(random.NextUniform(-3.0, 2.0));
    for (int r = kColorRow; r < p.rows(); ++r) {
      p.Row(r)[i] = static_cast<float>(random.NextUniform(-0.2, 0.2));
    }
  }
  return p;
}

}  // namespace

SyntheticIteration::SyntheticIteration(const SyntheticLoad& load, int threads)
    : load_(load),
      pool_(threads),
      picture_(load.width_px, load.height_px, load.channels),
      transmittance_(load.width_px, load.height_px, 1),
      target_(load.width_px, load.height_px, load.channels) {
  camera_.width = load.width_px;
  camera_.height = load.height_px;
  camera_.fx = camera_.fy = 0.9f * static_cast<float>(load.width_px);
  camera_.cx = 0.5f * static_cast<float>(load.width_px);
  camera_.cy = 0.5f * static_cast<float>(load.height_px);
  color_.channels = load.channels;
  for (int c = 0; c < load.channels; ++c) {
    color_.channel[c] = {kColorRow + kCoefficients * c, kCoefficients, 0.5f, true};
  }
  parameters_ = RandomGaussians(load, camera_);
  moments_ = {ParameterBlock(parameters_.rows(), load.gaussians),
              ParameterBlock(parameters_.rows(), load.gaussians)};
  learning_rates_.assign(parameters_.rows(), 1e-7f);  // keeps the load constant
  statistics_.Reset(load.gaussians);
  for (int c = 0; c < load.channels; ++c) {
    for (int y = 0; y < load.height_px; ++y) {
      for (int x = 0; x < load.width_px; ++x) {
        target_.Row(c, y)[x] = 0.5f + 0.3f * std::sin(0.1f * static_cast<float>(x + c)) *
                                          std::cos(0.07f * static_cast<float>(y));
      }
    }
  }
}

void SyntheticIteration::Project() {
  ProjectSplats({parameters_, color_, camera_}, false, pool_, splats_);
}
void SyntheticIteration::Bin() {
  binner_.Bin(splats_, camera_.width, camera_.height, pool_, lists_);
}
void SyntheticIteration::Forward() {
  RasterizeForward(
      splats_, lists_, kBlack, pool_, {picture_, &transmittance_, nullptr}, block_masks_);
}
void SyntheticIteration::Loss() {
  loss_.Evaluate(picture_, target_, nullptr, LossWeights(), pool_, d_picture_);
}
void SyntheticIteration::Backward() {
  RasterizeBackward(splats_, lists_, block_masks_, picture_, d_picture_, pool_, pair_gradient_);
}
void SyntheticIteration::ProjectBackward() {
  ProjectSplatsBackward({parameters_, color_, camera_},
                        splats_,
                        pair_gradient_,
                        lists_.first_pair,
                        pool_,
                        {GradientScope::kAll, gradient_, &statistics_});
}
void SyntheticIteration::Adam() {
  AdamStep(gradient_, learning_rates_, ++step_, pool_, parameters_, moments_);
}

int64_t SyntheticIteration::VisibleGaussians() const {
  return std::count_if(
      splats_.depth_key.begin(), splats_.depth_key.end(), [](uint32_t key) { return key != 0; });
}

int64_t SyntheticIteration::CoveredPixels() {
  std::fill(block_masks_.begin(), block_masks_.end(), uint16_t{0});
  Forward();
  int64_t blocks = 0;
  for (size_t i = 0; i < lists_.pair_count(); ++i) blocks += std::popcount(block_masks_[i]);
  return 16 * blocks;
}

}  // namespace color3d
