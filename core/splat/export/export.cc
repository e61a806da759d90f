#include "core/splat/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numeric>

#include "core/splat/export/bytes.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr size_t kSplatBytes = 32;

// The shortest decimals that read back as the same doubles, each after a blank.
std::string Numbers(const Eigen::Vector3d& v) {
  std::string text;
  for (int k = 0; k < 3; ++k) {
    char buffer[32];
    const auto [end, error] = std::to_chars(buffer, buffer + sizeof(buffer), v[k]);
    text += ' ';
    if (error == std::errc()) text.append(buffer, end);
  }
  return text;
}

std::string PlyHeader(size_t count,
                      int coefficients,
                      bool with_confidence,
                      const ExportFrame& frame) {
  std::string h = "ply\nformat binary_little_endian 1.0\n";
  if (!frame.left_out.isZero(0.0)) h += "comment offset" + Numbers(frame.left_out) + "\n";
  h += fmt::format("element vertex {}\n", count);
  const auto property = [&](const std::string& name) { h += "property float " + name + "\n"; };
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) property(name);
  for (int i = 0; i < 3; ++i) property(fmt::format("f_dc_{}", i));
  for (int i = 0; i < 3 * (coefficients - 1); ++i) property(fmt::format("f_rest_{}", i));
  property("opacity");
  for (int i = 0; i < 3; ++i) property(fmt::format("scale_{}", i));
  for (int i = 0; i < 4; ++i) property(fmt::format("rot_{}", i));
  if (with_confidence) property("confidence");
  return h + "end_header\n";
}

float Opacity(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }

// Largest volume times opacity first; ties by index.
std::vector<uint32_t> ByImportance(const ViewerGaussians& g) {
  std::vector<float> importance(g.size());
  for (size_t i = 0; i < g.size(); ++i) {
    const float* s = g.log_scale.data() + 3 * i;
    importance[i] = s[0] + s[1] + s[2] + std::log(Opacity(g.opacity_logit[i]) + 1e-30f);
  }
  std::vector<uint32_t> order(g.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t x, uint32_t y) {
    return importance[x] > importance[y];
  });
  return order;
}

}  // namespace

std::string EncodeGaussianPly(const GaussianModel& model,
                              const RgbHarmonics& rgb,
                              const ExportFrame& frame,
                              ThreadPool& pool,
                              bool with_confidence) {
  const ViewerGaussians g = ForViewers(model, rgb, frame, pool);
  const int coefficients = ShCoefficients(g.sh_degree);
  const size_t row_floats =
      17 + 3 * static_cast<size_t>(coefficients - 1) + (with_confidence ? 1 : 0);
  std::vector<float> rows(g.size() * row_floats, 0.0f);  // normals stay zero
  pool.ForRanges(static_cast<int64_t>(g.size()), [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) {
      float* out = rows.data() + i * row_floats;
      std::copy_n(g.position.data() + 3 * i, 3, out);
      out += 6;
      const float* sh = g.sh.data() + i * coefficients * 3;
      for (int c = 0; c < 3; ++c) *out++ = sh[c];
      for (int c = 0; c < 3; ++c) {
        for (int k = 1; k < coefficients; ++k) *out++ = sh[3 * k + c];
      }
      *out++ = g.opacity_logit[i];
      out = std::copy_n(g.log_scale.data() + 3 * i, 3, out);
      out = std::copy_n(g.rotation.data() + 4 * i, 4, out);
      if (with_confidence && !model.confidence.empty()) *out = model.confidence[i];
    }
  });
  std::string bytes = PlyHeader(g.size(), coefficients, with_confidence, frame);
  bytes.append(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(float));
  return bytes;
}

std::string EncodeSplat(const GaussianModel& model,
                        const RgbHarmonics& rgb,
                        const ExportFrame& frame,
                        ThreadPool& pool) {
  const ViewerGaussians g = ForViewers(model, rgb, frame, pool);
  const int coefficients = ShCoefficients(g.sh_degree);
  std::string bytes(g.size() * kSplatBytes, '\0');
  char* out = bytes.data();
  for (const uint32_t i : ByImportance(g)) {
    float floats[6];
    std::copy_n(g.position.data() + 3 * static_cast<size_t>(i), 3, floats);
    for (int k = 0; k < 3; ++k) floats[3 + k] = std::exp(g.log_scale[3 * i + k]);
    uint8_t tail[8];
    const float* sh = g.sh.data() + static_cast<size_t>(i) * coefficients * 3;
    for (int c = 0; c < 3; ++c) tail[c] = ColorByte(sh[c]);
    tail[3] = OpacityByte(g.opacity_logit[i]);
    for (int k = 0; k < 4; ++k) tail[4 + k] = RotationByte(g.rotation[4 * i + k]);
    std::memcpy(out, floats, sizeof(floats));
    std::memcpy(out + sizeof(floats), tail, sizeof(tail));
    out += kSplatBytes;
  }
  return bytes;
}

}  // namespace color3d
