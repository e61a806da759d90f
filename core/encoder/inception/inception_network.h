// The layers of Inception v3. Torch in the interface. Immutable, thread-safe. For this folder only.
#pragma once

#include <torch/types.h>

#include <array>
#include <initializer_list>
#include <map>
#include <string>

#include "core/weights/weight_reader.h"

namespace color3d {

class InceptionNetwork {
 public:
  explicit InceptionNetwork(WeightMap weights);

  int feature_count() const { return static_cast<int>(Channels(2048)); }
  std::string ToString() const;
  // Returns [1,C] for a picture [1,3,H,W] in 0..1.
  torch::Tensor Features(const torch::Tensor& rgb) const;

 private:
  // A convolution with its batch norm folded in, then ReLU.
  struct Convolution {
    torch::Tensor weight, bias;
    int64_t stride = 1;
    std::array<int64_t, 2> padding = {0, 0};
    torch::Tensor operator()(const torch::Tensor& x) const;
  };
  // Published channel counts. `valid`: no padding; else the size is kept at stride 1.
  struct Shape {
    int64_t in, out;
    int64_t height, width;
    int64_t stride = 1;
    bool valid = false;
  };

  int64_t Channels(int64_t published) const { return published / divisor_; }
  void Take(WeightReader& reader, const std::string& name, const Shape& shape);
  void TakeStem(WeightReader& reader);
  void TakeBlockA(WeightReader& reader, const std::string& block, int64_t in, int64_t pooled);
  void TakeBlockB(WeightReader& reader, const std::string& block);
  void TakeBlockC(WeightReader& reader, const std::string& block, int64_t inner);
  void TakeBlockD(WeightReader& reader, const std::string& block);
  void TakeBlockE(WeightReader& reader, const std::string& block, int64_t in);

  // Layers of `block` applied one after the other.
  torch::Tensor Run(const std::string& block,
                    torch::Tensor x,
                    std::initializer_list<const char*> layers) const;
  torch::Tensor MeanPool(const torch::Tensor& x) const;
  torch::Tensor RunStem(torch::Tensor x) const;
  torch::Tensor RunBlockA(const std::string& block, const torch::Tensor& x) const;
  torch::Tensor RunBlockB(const std::string& block, const torch::Tensor& x) const;
  torch::Tensor RunBlockC(const std::string& block, const torch::Tensor& x) const;
  torch::Tensor RunBlockD(const std::string& block, const torch::Tensor& x) const;
  torch::Tensor RunBlockE(const std::string& block, const torch::Tensor& x, bool max_pool) const;

  int64_t divisor_ = 1;
  bool of_fid_ = false;
  std::map<std::string, Convolution> layers_;
};

}  // namespace color3d
