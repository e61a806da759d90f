// SqueezeNet 1.1 (Iandola et al. 2016) trained on ImageNet, from its ONNX file: the teacher in
// pre-training and a peer in comparisons. Torch in the interface; thread-safe but for MoveTo.
#pragma once

#include <torch/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace color3d {

class SqueezeNet {
 public:
  // Reads the initialisers (float16 or float32) of the file; ignores its graph. Throws
  // Error{kInvalidArgument} if one is missing or the file is not an ONNX model.
  explicit SqueezeNet(const std::filesystem::path& onnx_file);

  void MoveTo(torch::Device device);

  struct Features {
    torch::Tensor conv1;   // [B,64,.,.]  cell i is centred on pixel 2 i + 1
    torch::Tensor fire3;   // [B,128,.,.] 4 i + 3
    torch::Tensor fire5;   // [B,256,.,.] 8 i + 7
    torch::Tensor fire9;   // [B,512,.,.] 16 i + 15
    torch::Tensor logits;  // [B,1000]
  };
  // `srgb` [B,3,H,W] in 0..1, at least 32 px.
  Features Run(const torch::Tensor& srgb) const;
  // Feature maps at strides 2, 4, 8, 16 with H / stride cells (H, W multiples of 16). Borders are
  // padded on alternating sides, so that cells are displaced by at most 2.5 px.
  std::vector<torch::Tensor> AlignedTaps(const torch::Tensor& srgb) const;

 private:
  static torch::Tensor Input(const torch::Tensor& srgb);
  torch::Tensor Convolve(const std::string& name, const torch::Tensor& x, int padding) const;
  torch::Tensor Fire(int index, const torch::Tensor& x) const;

  std::map<std::string, torch::Tensor> weights_;
};

}  // namespace color3d
