// The layers of LPIPS: AlexNet (Krizhevsky 2014) or VGG 16 (Simonyan and Zisserman 2015) up to
// their last convolution, and one learnt weight for each channel of five of their layers. Torch in
// the interface. Immutable, thread-safe. For this folder only.
#pragma once

#include <torch/types.h>

#include <string>
#include <vector>

#include "core/encoder/weight_tensors.h"
#include "core/weights/weight_reader.h"

namespace color3d {

class LpipsNetwork {
 public:
  LpipsNetwork(WeightMap backbone, WeightMap linear);

  std::string ToString() const;
  // Of two pictures [1,3,H,W] in 0..1.
  double Distance(const torch::Tensor& rgb, const torch::Tensor& other_rgb) const;

 private:
  // A convolution and ReLU.
  struct Convolution {
    Layer layer;
    int64_t stride = 1;
    int64_t padding = 1;
    bool pools_before = false;  // maxima at stride 2: of 3 x 3 px in AlexNet, 2 x 2 in VGG
    bool is_compared = false;
  };

  void TakeBackbone(WeightMap weights);
  void TakeLinear(WeightMap weights);
  // Of the compared layers, each pixel's features scaled to length 1.
  std::vector<torch::Tensor> Features(const torch::Tensor& rgb) const;

  bool is_alexnet_ = false;
  int64_t divisor_ = 1;
  std::vector<Convolution> layers_;
  std::vector<torch::Tensor> channel_weights_;
};

}  // namespace color3d
