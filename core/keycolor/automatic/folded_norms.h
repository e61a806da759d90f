// Normalisations of a trained network, folded into plain weights when it is loaded. Torch inside
// core/keycolor only.
#pragma once

#include <torch/types.h>

namespace color3d {

// Spectral normalisation as PyTorch stores it (Miyato et al. 2018): weight_orig / (u^T W v) with W
// of [out, everything else]. u and v are taken as stored, without a power iteration: that is what
// the trained network computes in evaluation.
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
