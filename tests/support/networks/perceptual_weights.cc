#include "tests/support/networks/perceptual_weights.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/networks/named_values.h"

namespace color3d {
namespace {

constexpr int64_t kDivisor = 16;

// `key` names the values, if another name is to have the same values as in the reference.
void Add(WeightMap* weights,
         const std::string& name,
         std::vector<int64_t> shape,
         double low,
         double high,
         const std::string& key = "") {
  size_t count = 1;
  for (const int64_t size : shape) count *= static_cast<size_t>(size);
  (*weights)[name] = {std::move(shape), NamedValues(key.empty() ? name : key, count, low, high)};
}

double KernelBound(const std::vector<int64_t>& shape) {
  return std::sqrt(6.0 / static_cast<double>(shape[1] * shape[2] * shape[3]));
}

struct Convolution {
  const char* name;
  int64_t in, out, height, width;
};

void AddUnit(WeightMap* weights, const std::string& name, const Convolution& convolution) {
  const int64_t in = convolution.in == 3 ? 3 : convolution.in / kDivisor;
  const int64_t out = convolution.out / kDivisor;
  const std::vector<int64_t> shape = {out, in, convolution.height, convolution.width};
  const double bound = KernelBound(shape);
  Add(weights, name + ".conv.weight", shape, -bound, bound);
  Add(weights, name + ".bn.weight", {out}, 0.8, 1.2);
  Add(weights, name + ".bn.bias", {out}, -0.2, 0.2);
  Add(weights, name + ".bn.running_mean", {out}, -0.2, 0.2);
  Add(weights, name + ".bn.running_var", {out}, 0.5, 1.5);
  Add(weights, name + ".bn.num_batches_tracked", {}, 0.0, 1.0);
}

void AddBlock(WeightMap* weights, const std::string& block, const std::vector<Convolution>& parts) {
  for (const Convolution& part : parts) AddUnit(weights, block + part.name, part);
}

std::vector<Convolution> BlockA(int64_t in, int64_t pooled) {
  return {{"branch1x1", in, 64, 1, 1},
          {"branch5x5_1", in, 48, 1, 1},
          {"branch5x5_2", 48, 64, 5, 5},
          {"branch3x3dbl_1", in, 64, 1, 1},
          {"branch3x3dbl_2", 64, 96, 3, 3},
          {"branch3x3dbl_3", 96, 96, 3, 3},
          {"branch_pool", in, pooled, 1, 1}};
}

std::vector<Convolution> BlockC(int64_t inner) {
  return {{"branch1x1", 768, 192, 1, 1},
          {"branch7x7_1", 768, inner, 1, 1},
          {"branch7x7_2", inner, inner, 1, 7},
          {"branch7x7_3", inner, 192, 7, 1},
          {"branch7x7dbl_1", 768, inner, 1, 1},
          {"branch7x7dbl_2", inner, inner, 7, 1},
          {"branch7x7dbl_3", inner, inner, 1, 7},
          {"branch7x7dbl_4", inner, inner, 7, 1},
          {"branch7x7dbl_5", inner, 192, 1, 7},
          {"branch_pool", 768, 192, 1, 1}};
}

std::vector<Convolution> BlockE(int64_t in) {
  return {{"branch1x1", in, 320, 1, 1},
          {"branch3x3_1", in, 384, 1, 1},
          {"branch3x3_2a", 384, 384, 1, 3},
          {"branch3x3_2b", 384, 384, 3, 1},
          {"branch3x3dbl_1", in, 448, 1, 1},
          {"branch3x3dbl_2", 448, 384, 3, 3},
          {"branch3x3dbl_3a", 384, 384, 1, 3},
          {"branch3x3dbl_3b", 384, 384, 3, 1},
          {"branch_pool", in, 192, 1, 1}};
}

struct Layer {
  int number;
  int64_t channels;
  int64_t kernel = 3;
};

WeightMap BackboneWeights(const std::string& backbone, const std::vector<Layer>& layers) {
  WeightMap weights;
  int64_t in = 3;
  for (const Layer& layer : layers) {
    const int64_t out = layer.channels / kDivisor;
    const std::string name = "features." + std::to_string(layer.number) + ".";
    const std::string key = backbone + "." + name;
    const std::vector<int64_t> shape = {out, in, layer.kernel, layer.kernel};
    const double bound = KernelBound(shape);
    Add(&weights, name + "weight", shape, -bound, bound, key + "weight");
    Add(&weights, name + "bias", {out}, -0.2, 0.2, key + "bias");
    in = out;
  }
  Add(&weights, "classifier.1.weight", {4, 4}, 0.0, 1.0);
  return weights;
}

}  // namespace

WeightMap SmallInceptionWeights(int classes) {
  WeightMap weights;
  AddBlock(&weights,
           "",
           {{"Conv2d_1a_3x3", 3, 32, 3, 3},
            {"Conv2d_2a_3x3", 32, 32, 3, 3},
            {"Conv2d_2b_3x3", 32, 64, 3, 3},
            {"Conv2d_3b_1x1", 64, 80, 1, 1},
            {"Conv2d_4a_3x3", 80, 192, 3, 3}});
  AddBlock(&weights, "Mixed_5b.", BlockA(192, 32));
  AddBlock(&weights, "Mixed_5c.", BlockA(256, 64));
  AddBlock(&weights, "Mixed_5d.", BlockA(288, 64));
  AddBlock(&weights,
           "Mixed_6a.",
           {{"branch3x3", 288, 384, 3, 3},
            {"branch3x3dbl_1", 288, 64, 1, 1},
            {"branch3x3dbl_2", 64, 96, 3, 3},
            {"branch3x3dbl_3", 96, 96, 3, 3}});
  AddBlock(&weights, "Mixed_6b.", BlockC(128));
  AddBlock(&weights, "Mixed_6c.", BlockC(160));
  AddBlock(&weights, "Mixed_6d.", BlockC(160));
  AddBlock(&weights, "Mixed_6e.", BlockC(192));
  AddBlock(&weights,
           "Mixed_7a.",
           {{"branch3x3_1", 768, 192, 1, 1},
            {"branch3x3_2", 192, 320, 3, 3},
            {"branch7x7x3_1", 768, 192, 1, 1},
            {"branch7x7x3_2", 192, 192, 1, 7},
            {"branch7x7x3_3", 192, 192, 7, 1},
            {"branch7x7x3_4", 192, 192, 3, 3}});
  AddBlock(&weights, "Mixed_7b.", BlockE(1280));
  AddBlock(&weights, "Mixed_7c.", BlockE(2048));
  Add(&weights, "fc.weight", {classes, 2048 / kDivisor}, 0.0, 1.0);
  Add(&weights, "fc.bias", {classes}, 0.0, 1.0);
  return weights;
}

WeightMap SmallAlexNetWeights() {
  return BackboneWeights("alex", {{0, 64, 11}, {3, 192, 5}, {6, 384}, {8, 256}, {10, 256}});
}

WeightMap SmallVggWeights() {
  return BackboneWeights("vgg",
                         {{0, 64},
                          {2, 64},
                          {5, 128},
                          {7, 128},
                          {10, 256},
                          {12, 256},
                          {14, 256},
                          {17, 512},
                          {19, 512},
                          {21, 512},
                          {24, 512},
                          {26, 512},
                          {28, 512}});
}

WeightMap SmallLpipsLinearWeights(const char* backbone) {
  const bool is_alexnet = std::string(backbone) == "alex";
  const std::vector<int64_t> channels = is_alexnet ? std::vector<int64_t>{64, 192, 384, 256, 256}
                                                   : std::vector<int64_t>{64, 128, 256, 512, 512};
  WeightMap weights;
  for (size_t i = 0; i < channels.size(); ++i) {
    const std::string name = "lin" + std::to_string(i) + ".model.1.weight";
    Add(&weights,
        name,
        {1, channels[i] / kDivisor, 1, 1},
        0.0,
        1.0,
        std::string(backbone) + "." + name);
  }
  return weights;
}

}  // namespace color3d
