#include "core/keycolor/automatic/folded_norms.h"

#include <torch/types.h>

namespace color3d {
namespace {

constexpr double kBatchNormEpsilon = 1e-5;

}  // namespace

torch::Tensor FoldSpectralNorm(const torch::Tensor& weight_orig,
                               const torch::Tensor& u,
                               const torch::Tensor& v) {
  if (weight_orig.numel() == 0) return weight_orig;
  const torch::Tensor matrix = weight_orig.contiguous().flatten(1);
  return weight_orig / torch::dot(u, torch::mv(matrix, v));
}

ChannelAffine FoldBatchNorm(const torch::Tensor& weight,
                            const torch::Tensor& bias,
                            const torch::Tensor& running_mean,
                            const torch::Tensor& running_variance) {
  const torch::Tensor scale = weight * (running_variance + kBatchNormEpsilon).rsqrt();
  return {scale, bias - running_mean * scale};
}

}  // namespace color3d
