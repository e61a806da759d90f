#include "tests/bench/colorizer/bench_encoder.h"

#include <torch/types.h>

#include "core/color/lab.h"
#include "core/encoder/convnext/convnext.h"
#include "core/encoder/image_tensors.h"
#include "tests/bench/pretrain/squeezenet.h"
#include "tests/support/networks/random_features.h"

namespace color3d {
namespace {

// SqueezeNet as TapEncoder.
class SqueezeNetEncoder : public TapEncoder {
 public:
  explicit SqueezeNetEncoder(const std::filesystem::path& file)
      : network_(file), digest_(64, '0'), description_("SqueezeNet 1.1, ImageNet") {
    config_.dims = {64, 128, 256, 512};
    config_.depths = {0, 0, 0, 0};
  }
  const std::string& digest() const override { return digest_; }
  const std::string& description() const override { return description_; }
  const ConvNextConfig& config() const override { return config_; }

  std::vector<double> Describe(const Image& luminance) const override {
    const torch::Tensor tap = DeepTap(luminance)[0].flatten(1).to(torch::kFloat64);
    const torch::Tensor pooled = torch::cat({tap.mean(1), tap.std(1, false)}).contiguous();
    return {pooled.data_ptr<double>(), pooled.data_ptr<double>() + pooled.numel()};
  }
  Image DeepFeatures(const Image& luminance) const override {
    return ImageFromTensor(DeepTap(luminance));
  }
  torch::Tensor Input(const torch::Tensor& luminance) const override {
    torch::NoGradGuard no_grad;
    torch::Tensor gray = torch::empty_like(luminance);
    const float* l = luminance.data_ptr<float>();
    float* out = gray.data_ptr<float>();
    for (int64_t i = 0; i < luminance.numel(); ++i) {
      out[i] = static_cast<float>(GrayFromLuminance(l[i]));
    }
    return gray.expand({gray.size(0), 3, gray.size(2), gray.size(3)});
  }
  std::vector<torch::Tensor> Taps(const torch::Tensor& input, const BlockAdapter&) const override {
    return network_.AlignedTaps(input);
  }

 private:
  torch::Tensor DeepTap(const Image& luminance) const {
    const torch::Tensor x = TensorFromImage(luminance);
    const int64_t right = (16 - x.size(3) % 16) % 16;
    const int64_t bottom = (16 - x.size(2) % 16) % 16;
    return Taps(Input(torch::replication_pad2d(x, {0, right, 0, bottom})), {}).back();
  }

  SqueezeNet network_;
  ConvNextConfig config_;
  std::string digest_;
  std::string description_;
};

}  // namespace

std::shared_ptr<const Encoder> BenchEncoder(const std::string& name) {
  constexpr char kSqueezeNet[] = "squeezenet=";
  if (name == "embedded") return Encoder::Embedded();
  const ConvNextConfig config;
  if (name == "random") {
    constexpr uint64_t kSeed = 2026;
    return std::make_shared<const ConvNext>(
        config, RandomFeatureWeights(config, kSeed), "random features, " + config.ToString());
  }
  if (name.starts_with(kSqueezeNet)) {
    return std::make_shared<const SqueezeNetEncoder>(name.substr(sizeof(kSqueezeNet) - 1));
  }
  return Encoder::FromWeightFile(name);
}

}  // namespace color3d
