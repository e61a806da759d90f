// Folds the normalisations of a trained network into its weights at load time. Torch in the
// interface; used inside core/keycolor only.
#pragma once

#include <torch/types.h>

namespace color3d {

// Spectral normalisation as PyTorch stores it (Miyato et al. 2018): weight_orig / (u^T W v) with W
// of [out, everything else]. Uses u and v as stored, without power iteration, as the trained
// network does in evaluation.
torch::Tensor FoldSpectralNorm(const torch::Tensor& weight_orig,
                               const torch::Tensor& u,
                               const torch::Tensor& v);

// Batch normalisation in evaluation: y = scale * x + shift per channel.
struct ChannelAffine {
  torch::Tensor scale;  // [C]
  torch::Tensor shift;  // [C]
};
ChannelAffine FoldBatchNorm(const torch::Tensor& weight,
                            const torch::Tensor& bias,
                            const torch::Tensor& running_mean,
                            const torch::Tensor& running_variance);

}  // namespace color3d
