#include "tests/bench/pretrain/squeezenet.h"

#include <torch/types.h>

#include <cstring>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

// The few fields of an ONNX file (a protocol buffer) that hold weights.
class WireReader {
 public:
  explicit WireReader(std::string_view bytes) : bytes_(bytes) {}

  // Reads the next field; returns false at the end. Numbers are in `number`, other fields in
  // `payload`.
  bool Next() {
    if (position_ >= bytes_.size()) return false;
    const uint64_t key = Varint();
    field = static_cast<int>(key >> 3u);
    switch (key & 7u) {
      case 0:
        number = Varint();
        break;
      case 1:
        payload = Take(8);
        break;
      case 2:
        payload = Take(Varint());
        break;
      case 5:
        payload = Take(4);
        break;
      default:
        throw InvalidArgument("the teacher is not an ONNX model");
    }
    return true;
  }
  int field = 0;
  uint64_t number = 0;
  std::string_view payload;

 private:
  uint64_t Varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      if (position_ >= bytes_.size()) break;
      const auto byte = static_cast<unsigned char>(bytes_[position_++]);
      value |= static_cast<uint64_t>(byte & 127u) << shift;
      if (byte < 128) return value;
    }
    throw InvalidArgument("the teacher is not an ONNX model, or truncated");
  }
  std::string_view Take(uint64_t size) {
    if (size > bytes_.size() - position_) throw InvalidArgument("the teacher file is truncated");
    const std::string_view part = bytes_.substr(position_, size);
    position_ += size;
    return part;
  }
  std::string_view bytes_;
  size_t position_ = 0;
};

// onnx.TensorProto: dims = 1, data_type = 2 (1 float32, 10 float16), name = 8, raw_data = 9.
std::pair<std::string, torch::Tensor> ReadTensor(std::string_view bytes) {
  WireReader reader(bytes);
  std::vector<int64_t> shape;
  uint64_t type = 0;
  std::string name;
  std::string_view raw;
  while (reader.Next()) {
    if (reader.field == 1) shape.push_back(static_cast<int64_t>(reader.number));
    if (reader.field == 2) type = reader.number;
    if (reader.field == 8) name = reader.payload;
    if (reader.field == 9) raw = reader.payload;
  }
  torch::Tensor tensor = torch::empty(shape, type == 10 ? torch::kHalf : torch::kFloat32);
  if ((type != 1 && type != 10) || raw.size() != tensor.nbytes()) return {name, torch::Tensor()};
  std::memcpy(tensor.data_ptr(), raw.data(), raw.size());
  return {name, tensor.to(torch::kFloat32)};
}

}  // namespace

SqueezeNet::SqueezeNet(const std::filesystem::path& onnx_file) {
  const std::string bytes = ReadFile(onnx_file);
  WireReader model(bytes);
  while (model.Next()) {
    if (model.field != 7) continue;  // graph
    WireReader graph(model.payload);
    while (graph.Next()) {
      if (graph.field != 5) continue;  // initializer
      auto [name, tensor] = ReadTensor(graph.payload);
      if (!tensor.defined()) continue;
      if (tensor.dim() == 4) tensor = tensor.contiguous(at::MemoryFormat::ChannelsLast);
      weights_[name] = tensor;
    }
  }
  if (!weights_.contains("conv10_w_0")) {
    throw InvalidArgument("{} is not SqueezeNet 1.1: it has no conv10_w_0", onnx_file.string());
  }
}

void SqueezeNet::MoveTo(torch::Device device) {
  for (auto& [name, tensor] : weights_) tensor = tensor.to(device);
}

torch::Tensor SqueezeNet::Convolve(const std::string& name,
                                   const torch::Tensor& x,
                                   int padding) const {
  const int stride = name == "conv1" ? 2 : 1;
  return torch::relu(
      torch::conv2d(x, weights_.at(name + "_w_0"), weights_.at(name + "_b_0"), stride, padding));
}

torch::Tensor SqueezeNet::Fire(int index, const torch::Tensor& x) const {
  const std::string name = "fire" + std::to_string(index) + "/";
  const torch::Tensor squeezed = Convolve(name + "squeeze1x1", x, 0);
  return torch::cat(
      {Convolve(name + "expand1x1", squeezed, 0), Convolve(name + "expand3x3", squeezed, 1)}, 1);
}

torch::Tensor SqueezeNet::Input(const torch::Tensor& srgb) {
  const torch::Tensor mean =
      torch::tensor({103.94f, 116.78f, 123.68f}).view({1, 3, 1, 1}).to(srgb.device());
  return (255.0 * srgb.flip(1) - mean).contiguous(at::MemoryFormat::ChannelsLast);
}

SqueezeNet::Features SqueezeNet::Run(const torch::Tensor& srgb) const {
  torch::NoGradGuard no_grad;
  Features features;
  features.conv1 = Convolve("conv1", Input(srgb), 0);
  features.fire3 = Fire(3, Fire(2, torch::max_pool2d(features.conv1, 3, 2)));
  features.fire5 = Fire(5, Fire(4, torch::max_pool2d(features.fire3, 3, 2)));
  const torch::Tensor x = torch::max_pool2d(features.fire5, 3, 2);
  features.fire9 = Fire(9, Fire(8, Fire(7, Fire(6, x))));
  features.logits = Convolve("conv10", features.fire9, 0).mean({2, 3});
  return features;
}

std::vector<torch::Tensor> SqueezeNet::AlignedTaps(const torch::Tensor& srgb) const {
  torch::NoGradGuard no_grad;
  const auto pad_after = [](const torch::Tensor& x) {
    return torch::replication_pad2d(x, {0, 1, 0, 1});
  };
  const auto pad_before = [](const torch::Tensor& x) {
    return torch::replication_pad2d(x, {1, 0, 1, 0});
  };
  std::vector<torch::Tensor> taps;
  taps.push_back(Convolve("conv1", pad_after(Input(srgb)), 0));
  taps.push_back(Fire(3, Fire(2, torch::max_pool2d(pad_before(taps.back()), 3, 2))));
  taps.push_back(Fire(5, Fire(4, torch::max_pool2d(pad_after(taps.back()), 3, 2))));
  const torch::Tensor x = torch::max_pool2d(pad_before(taps.back()), 3, 2);
  taps.push_back(Fire(9, Fire(8, Fire(7, Fire(6, x)))));
  return taps;
}

}  // namespace color3d
