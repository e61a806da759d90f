#include "core/keycolor/automatic/ddcolor_decoder.h"

#include <torch/types.h>

#include <algorithm>

#include "core/base/error.h"
#include "core/encoder/weight_tensors.h"

namespace color3d {
namespace {

constexpr int64_t kLastScale = 4;  // from stride 4 to the picture's pixels
constexpr int64_t kRowsAtOnce = 2048;

torch::Tensor Apply(const ChannelAffine& affine, const torch::Tensor& x) {
  const int64_t c = x.size(1);
  return torch::addcmul(affine.shift.view({1, c, 1, 1}), x, affine.scale.view({1, c, 1, 1}));
}

// Blur that removes the checkerboard of the pixel shuffle (Sugawara et al. 2018): mean over 2x2,
// with replication at the left and upper borders.
torch::Tensor Blur(const torch::Tensor& x) {
  return torch::avg_pool2d(torch::replication_pad2d(x, {1, 0, 1, 0}), {2, 2}, {1, 1});
}

}  // namespace

// Problems found while folding norms. Reported after missing arrays.
struct DdcolorDecoder::Problems {
  std::string first;

  void Check(const std::string& name, const torch::Tensor& folded) {
    if (first.empty() && !torch::isfinite(folded).all().item<bool>()) first = name;
  }
  void Throw() const {
    if (first.empty()) return;
    throw InvalidArgument(
        "the DDColor weights cannot be used: the norm of \"{}\" divides by zero or by a negative "
        "variance",
        first);
  }
};

namespace {

torch::Tensor TakeSpectral(const std::string& name,
                           const std::vector<int64_t>& shape,
                           WeightReader& reader) {
  const torch::Tensor weight = TakeTensor(reader, name + ".weight_orig", shape);
  int64_t columns = 1;
  for (size_t i = 1; i < shape.size(); ++i) columns *= shape[i];
  const torch::Tensor u = TakeTensor(reader, name + ".weight_u", {shape[0]});
  const torch::Tensor v = TakeTensor(reader, name + ".weight_v", {columns});
  return FoldSpectralNorm(weight, u, v);
}

ChannelAffine TakeBatchNorm(const std::string& name, int64_t channels, WeightReader& reader) {
  return FoldBatchNorm(TakeTensor(reader, name + ".weight", {channels}),
                       TakeTensor(reader, name + ".bias", {channels}),
                       TakeTensor(reader, name + ".running_mean", {channels}),
                       TakeTensor(reader, name + ".running_var", {channels}));
}

}  // namespace

DdcolorDecoder::UpBlock DdcolorDecoder::TakeUpBlock(
    const std::string& name, int64_t in, int64_t skip, WeightReader& reader, Problems& problems) {
  UpBlock block;
  const std::string shuffle = name + "shuf.conv.0";
  const int64_t up = StoredSize(reader, shuffle + ".weight_orig", 0) / 4;
  const torch::Tensor weight = TakeSpectral(shuffle, {4 * up, in, 1, 1}, reader);
  const ChannelAffine norm = TakeBatchNorm(name + "shuf.conv.1", 4 * up, reader);
  block.shuffle_weight = weight * norm.scale.view({4 * up, 1, 1, 1});
  block.shuffle_bias = norm.shift;
  problems.Check(shuffle, block.shuffle_weight);
  problems.Check(name + "shuf.conv.1", block.shuffle_bias);
  block.skip = TakeBatchNorm(name + "bn", skip, reader);
  problems.Check(name + "bn", block.skip.shift);
  const int64_t out = StoredSize(reader, name + "conv.0.weight_orig", 0);
  block.conv_weight = TakeSpectral(name + "conv.0", {out, up + skip, 3, 3}, reader);
  problems.Check(name + "conv.0", block.conv_weight);
  block.out = TakeBatchNorm(name + "conv.2", out, reader);
  problems.Check(name + "conv.2", block.out.shift);
  return block;
}

DdcolorDecoder::DdcolorDecoder(const std::vector<int>& dims, WeightReader& reader) {
  Problems problems;
  reader.Ignore(".num_batches_tracked");
  int64_t in = dims.back();
  std::vector<int64_t> channels;
  for (int i = 0; i + 1 < static_cast<int>(dims.size()); ++i) {
    const int64_t skip = dims[dims.size() - 2 - i];
    blocks_.push_back(
        TakeUpBlock("decoder.layers." + std::to_string(i) + ".", in, skip, reader, problems));
    in = blocks_.back().conv_weight.size(0);
    channels.push_back(in);
  }
  queries_ = std::make_unique<const ColorQueries>(channels, reader);
  const int64_t width = queries_->embedding_channels();
  constexpr int64_t kSubPixels = kLastScale * kLastScale;
  const std::string last = "decoder.last_shuf.conv.0";
  // Rows are stored (channel, sub-pixel); the other order makes mixing channels one product.
  last_weight_ = TakeSpectral(last, {width * kSubPixels, in, 1, 1}, reader)
                     .contiguous()
                     .view({width, kSubPixels, in})
                     .transpose(0, 1)
                     .reshape({width * kSubPixels, in});
  last_bias_ = TakeTensor(reader, last + ".bias", {width * kSubPixels})
                   .view({width, kSubPixels})
                   .t()
                   .reshape({width * kSubPixels});
  problems.Check(last, last_weight_);
  refine_weight_ = TakeSpectral("refine_net.0.0", {2, queries_->query_count() + 3, 1, 1}, reader)
                       .flatten(1)
                       .contiguous();
  refine_bias_ = TakeTensor(reader, "refine_net.0.0.bias", {2});
  problems.Check("refine_net.0.0", refine_weight_);
  reader.Finish();
  problems.Throw();
}

torch::Tensor DdcolorDecoder::RunUpBlock(const UpBlock& block,
                                         const torch::Tensor& x,
                                         const torch::Tensor& tap) const {
  torch::Tensor up = torch::conv2d(x, block.shuffle_weight, block.shuffle_bias).relu_();
  up = Blur(torch::pixel_shuffle(up, 2));
  const torch::Tensor both = torch::cat({up, Apply(block.skip, tap)}, 1).relu_();
  return Apply(block.out,
               torch::conv2d(both, block.conv_weight, {}, /*stride=*/1, /*padding=*/1).relu_());
}

// The published graph shuffles 256 channels to full size, multiplies them with the embeddings of
// the queries to 100 maps and mixes these to ab. All operations after the rectifier are linear and
// equal at every pixel, so the mixture comes first: 2 channels at full size instead of 256 and 100.
torch::Tensor DdcolorDecoder::Forward(const std::vector<torch::Tensor>& taps,
                                      const torch::Tensor& input) const {
  std::vector<torch::Tensor> levels;
  torch::Tensor x = taps.back();
  for (size_t i = 0; i < blocks_.size(); ++i) {
    x = RunUpBlock(blocks_[i], x, taps[taps.size() - 2 - i]);
    levels.push_back(x);
  }
  const int64_t count = queries_->query_count();
  const torch::Tensor mixture =
      torch::mm(refine_weight_.slice(1, 0, count), queries_->Forward(levels)).t().contiguous();
  const int64_t height = x.size(2);
  const int64_t width = x.size(3);
  const torch::Tensor pixels = x[0].flatten(1).t();  // [h*w, C]
  std::vector<torch::Tensor> parts;
  for (int64_t row = 0; row < pixels.size(0); row += kRowsAtOnce) {
    const int64_t end = std::min(row + kRowsAtOnce, pixels.size(0));
    const torch::Tensor features =
        torch::addmm(last_bias_, pixels.slice(0, row, end), last_weight_.t()).relu_();
    parts.push_back(torch::mm(features.view({-1, mixture.size(0)}), mixture));
  }
  const torch::Tensor ab = torch::cat(parts)
                               .view({height, width, kLastScale, kLastScale, 2})
                               .permute({4, 0, 2, 1, 3})
                               .reshape({1, 2, height * kLastScale, width * kLastScale});
  const torch::Tensor gray_weight = refine_weight_.slice(1, count).contiguous().view({2, 3, 1, 1});
  return Blur(ab) + torch::conv2d(input, gray_weight, refine_bias_);
}

}  // namespace color3d
