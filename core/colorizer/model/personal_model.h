// The trained part of a colorizer: per-scene decoder and Conv-Adapters around the shared frozen
// encoder (STILL.md "Stage 1d"). Torch in the interface; used inside core/colorizer only.
// Forward() is const: concurrent calls are safe while the parameters do not change.
#pragma once

#include <torch/types.h>

#include <array>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/colorizer/model/named_tensors.h"
#include "core/encoder/convnext/convnext.h"

namespace color3d {

struct PersonalModelConfig {
  bool instance_norm = false;  // per picture (paper); else statistics frozen from the key view
  int adapter_stages = 0;      // number of deepest stages with Conv-Adapters in every block
  int adapter_kernel = 7;
  int adapter_reduction = 8;   // gamma
  double decoder_width = 1.0;  // factor on DecoderWidth()
  // The head has an output for each pixel of the stride, which a pixel shuffle puts in its place.
  bool full_resolution = false;
  // Matrix products and convolutions in bfloat16 (parameters, sums and statistics stay float32):
  // several times faster on processors with instructions for it. For training only.
  bool half_products = false;

  bool HasAdapters() const { return adapter_stages > 0; }
};

// Decoder channels at a tap of `stride`: 32 at 2 px, 64 at 4, 96 at 8, 128 from 16 on.
int DecoderWidth(int stride);

class PersonalModel {
 public:
  // Initializes the parameters from `random`. `encoder` must outlive the model. The adapters start
  // at zero and the head at `mean_ab` (Lab units / kAbScale).
  PersonalModel(const TapEncoder& encoder,
                const PersonalModelConfig& config,
                const std::array<float, 2>& mean_ab,
                Random& random);

  const PersonalModelConfig& config() const { return config_; }
  const std::string& EncoderDigest() const { return encoder_.digest(); }
  // 1 at full resolution, else the stride of the first tap.
  int OutputStride() const { return config_.full_resolution ? 1 : encoder_.config().stem_stride; }

  // Returns ab / kAbScale at the output's stride, [B,2,H/s,W/s], for L [B,1,H,W] (0..100).
  // Requires: H and W are multiples of the last tap's stride.
  torch::Tensor Forward(const torch::Tensor& luminance) const;
  // Forward from given taps. Requires: no adapters.
  torch::Tensor Decode(const std::vector<torch::Tensor>& taps,
                       const torch::Tensor& luminance) const;
  std::vector<torch::Tensor> Taps(const torch::Tensor& luminance) const;
  // Taps for TapEncoder::Input(luminance), with gradients to it.
  std::vector<torch::Tensor> TapsOfInput(const torch::Tensor& input) const;
  // The decoder's last activation, [B,C,H/t,W/t] with t the stride of the first tap. Decode applies
  // the head to it.
  torch::Tensor Features(const std::vector<torch::Tensor>& taps,
                         const torch::Tensor& luminance) const;

  // Measures mean and deviation of every normalised activation on this picture, layer after layer,
  // and freezes them. No effect with instance norm.
  void FreezeStatistics(const torch::Tensor& luminance);

  // Trained parameters and frozen statistics, all that Forward depends on, each in a fixed order.
  // The tensors share storage with the model.
  const NamedTensors& parameters() const { return parameters_; }
  const NamedTensors& statistics() const { return statistics_; }
  void RequireGradients(bool on);
  void set_half_products(bool on) { config_.half_products = on; }

 private:
  struct Norm {
    torch::Tensor weight, bias;             // trained
    torch::Tensor mean, inverse_deviation;  // frozen
  };
  struct ResidualBlock {
    torch::Tensor conv1, bias1, conv2, bias2;
    Norm norm;
  };
  struct Level {
    torch::Tensor fuse, fuse_bias;
    Norm norm;
    std::vector<ResidualBlock> blocks;
  };
  struct Adapter {
    torch::Tensor grouped, grouped_bias, pointwise, pointwise_bias, scale;
  };

  torch::Tensor NewParameter(const std::string& name,
                             std::vector<int64_t> shape,
                             double deviation,
                             Random& random);
  torch::Tensor NewConstant(const std::string& name, std::vector<int64_t> shape, float value);
  Norm NewNorm(const std::string& name, int64_t channels);
  void AddLevel(const std::string& name, int64_t in, int64_t out, Random& random);
  void AddAdapters(Random& random);
  // `weight` * x + `bias`, normalised; 3x3 with a border of 1, or 1x1.
  torch::Tensor NormalizedConv(const torch::Tensor& x,
                               const torch::Tensor& weight,
                               const torch::Tensor& bias,
                               const Norm& norm) const;
  torch::Tensor Conv(const torch::Tensor& x,
                     const torch::Tensor& weight,
                     const torch::Tensor& bias) const;
  torch::Tensor Normalize(const Norm& norm, const torch::Tensor& x) const;
  torch::Tensor Fuse(const Level& level,
                     const torch::Tensor& tap,
                     const torch::Tensor& below,
                     const torch::Tensor& luminance) const;
  torch::Tensor RunBlock(const ResidualBlock& block, const torch::Tensor& x) const;
  torch::Tensor Adapt(int stage, int block, const torch::Tensor& x) const;

  const TapEncoder& encoder_;
  PersonalModelConfig config_;
  std::vector<Level> levels_;  // fine to coarse
  std::vector<std::vector<Adapter>> adapters_;
  torch::Tensor head_, head_bias_;
  bool measuring_statistics_ = false;
  NamedTensors parameters_;
  NamedTensors statistics_;
};

// Scale from the network's output to ab in Lab units.
inline constexpr float kAbScale = 110.0f;

}  // namespace color3d
