#include "core/splat/export/glb/glb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/base/bytes/little_endian.h"
#include "core/base/error.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

constexpr char kExtension[] = "KHR_gaussian_splatting";
constexpr uint32_t kMagic = 0x46546c67;  // "glTF"
constexpr uint32_t kJsonChunk = 0x4e4f534a;
constexpr uint32_t kBinaryChunk = 0x004e4942;
constexpr int kFloat = 5126;
constexpr int kUnsignedByte = 5121;
constexpr int kArrayBuffer = 34962;
constexpr int kPoints = 0;

float Opacity(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }

class GlbWriter {
 public:
  explicit GlbWriter(const ViewerGaussians& gaussians) : g_(gaussians) {}

  std::string Write() {
    Positions();
    Fallback();
    std::vector<float> rotation;  // x y z w
    rotation.reserve(g_.rotation.size());
    for (size_t i = 0; i < g_.size(); ++i) {
      for (const int k : {1, 2, 3, 0}) rotation.push_back(g_.rotation[4 * i + k]);
    }
    Floats("ROTATION", "VEC4", rotation);
    std::vector<float> scale(g_.log_scale.size());
    std::transform(g_.log_scale.begin(), g_.log_scale.end(), scale.begin(), [](float s) {
      return std::exp(s);
    });
    Floats("SCALE", "VEC3", scale);
    std::vector<float> opacity(g_.size());
    std::transform(g_.opacity_logit.begin(), g_.opacity_logit.end(), opacity.begin(), Opacity);
    Floats("OPACITY", "SCALAR", opacity);
    Harmonics();
    return File();
  }

 private:
  ordered_json& Add(const std::string& name, const char* type, int component, size_t bytes) {
    views_.push_back({{"buffer", 0},
                      {"byteOffset", binary_.size()},
                      {"byteLength", bytes},
                      {"target", kArrayBuffer}});
    accessors_.push_back({{"bufferView", views_.size() - 1},
                          {"componentType", component},
                          {"count", g_.size()},
                          {"type", type}});
    attributes_[name] = accessors_.size() - 1;
    return accessors_.back();
  }

  void Floats(const std::string& name, const char* type, const std::vector<float>& values) {
    Add(std::string(kExtension) + ":" + name, type, kFloat, values.size() * sizeof(float));
    Append(values);
  }

  void Append(const std::vector<float>& values) {
    binary_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  }

  void Positions() {
    std::vector<float> low(g_.position.begin(), g_.position.begin() + 3), high = low;
    for (size_t i = 0; i < g_.position.size(); ++i) {
      low[i % 3] = std::min(low[i % 3], g_.position[i]);
      high[i % 3] = std::max(high[i % 3], g_.position[i]);
    }
    ordered_json& accessor = Add("POSITION", "VEC3", kFloat, g_.position.size() * sizeof(float));
    accessor["min"] = low;
    accessor["max"] = high;
    Append(g_.position);
  }

  // Coloured points, for programs without the extension.
  void Fallback() {
    Add("COLOR_0", "VEC4", kUnsignedByte, 4 * g_.size())["normalized"] = true;
    const size_t row = 3 * static_cast<size_t>(ShCoefficients(g_.sh_degree));
    const auto byte = [](float unit) {
      return static_cast<char>(
          static_cast<uint8_t>(std::lround(255.0f * std::clamp(unit, 0.0f, 1.0f))));
    };
    for (size_t i = 0; i < g_.size(); ++i) {
      for (int c = 0; c < 3; ++c) binary_.push_back(byte(0.5f + kShDc * g_.sh[i * row + c]));
      binary_.push_back(byte(Opacity(g_.opacity_logit[i])));
    }
  }

  void Harmonics() {
    const size_t coefficients = static_cast<size_t>(ShCoefficients(g_.sh_degree));
    std::vector<float> values(3 * g_.size());
    for (int degree = 0; degree <= g_.sh_degree; ++degree) {
      const int first = degree * degree;
      for (int k = 0; k <= 2 * degree; ++k) {
        for (size_t i = 0; i < g_.size(); ++i) {
          std::copy_n(g_.sh.data() + (i * coefficients + first + k) * 3, 3, values.data() + 3 * i);
        }
        Floats(fmt::format("SH_DEGREE_{}_COEF_{}", degree, k), "VEC3", values);
      }
    }
  }

  std::string File() const {
    ordered_json root;
    root["asset"] = {{"version", "2.0"}, {"generator", "Color3D"}};
    root["extensionsUsed"][0] = kExtension;
    root["scene"] = 0;
    root["scenes"][0]["nodes"][0] = 0;
    root["nodes"][0] = {{"mesh", 0}, {"rotation", {1, 0, 0, 0}}};
    ordered_json primitive;
    primitive["attributes"] = attributes_;
    primitive["mode"] = kPoints;
    primitive["extensions"][kExtension] = {{"kernel", "ellipse"},
                                           {"colorSpace", "srgb_rec709_display"},
                                           {"sortingMethod", "cameraDistance"},
                                           {"projection", "perspective"}};
    root["meshes"][0]["primitives"][0] = primitive;
    root["buffers"][0]["byteLength"] = binary_.size();
    root["bufferViews"] = views_;
    root["accessors"] = accessors_;
    std::string json = root.dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const size_t total = 12 + 8 + json.size() + 8 + binary_.size();
    if (total > std::numeric_limits<uint32_t>::max()) {
      throw InvalidArgument("{} Gaussians make a glb larger than 4 GB", g_.size());
    }
    std::string file;
    file.reserve(total);
    for (const uint64_t number : {uint64_t{kMagic},
                                  uint64_t{2},
                                  uint64_t{total},
                                  uint64_t{json.size()},
                                  uint64_t{kJsonChunk}}) {
      PutLittleEndian(number, 4, &file);
    }
    file += json;
    PutLittleEndian(binary_.size(), 4, &file);
    PutLittleEndian(kBinaryChunk, 4, &file);
    return file + binary_;
  }

  const ViewerGaussians& g_;
  std::string binary_;  // all parts are multiples of 4 bytes
  ordered_json views_ = ordered_json::array();
  ordered_json accessors_ = ordered_json::array();
  ordered_json attributes_;
};

}  // namespace

std::string EncodeGlb(const ViewerGaussians& gaussians) {
  if (gaussians.size() == 0) {
    throw InvalidArgument("there are no Gaussians, and glTF has no empty accessors");
  }
  CheckFinite(gaussians);
  return GlbWriter(gaussians).Write();
}

}  // namespace color3d
