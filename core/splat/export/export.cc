#include "core/splat/export/export.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numeric>

#include "core/base/error.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr double kMaxRoundingOfExtent = 1e-3;
constexpr double kFloatHalfUlp = 0x1p-24;  // relative
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

void CheckColors(const GaussianModel& model, const RgbHarmonics& rgb) {
  CheckModel(model);
  const size_t wanted = model.size() * static_cast<size_t>(ShCoefficients(rgb.degree)) * 3;
  if (rgb.sh.size() == wanted) return;
  throw InvalidArgument("RGB harmonics have {} numbers, {} are needed; fit them to this model",
                        rgb.sh.size(),
                        wanted);
}

void FilePosition(const GaussianModel& model, const ExportFrame& frame, size_t i, float* out) {
  for (int k = 0; k < 3; ++k) {
    out[k] = static_cast<float>(frame.scale * model.position[3 * i + k] + frame.offset[k]);
  }
}

// Normalised; the identity when the model's is zero.
void FileRotation(const GaussianModel& model, size_t i, float* out) {
  const float* q = model.rotation.data() + 4 * i;
  const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const bool usable = norm > 1e-12f && std::isfinite(norm);
  for (int k = 0; k < 4; ++k) out[k] = usable ? q[k] / norm : (k == 0 ? 1.0f : 0.0f);
}

float Opacity(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }

uint8_t Byte(float value) {
  return static_cast<uint8_t>(std::lround(std::clamp(value, 0.0f, 255.0f)));
}

// Largest volume times opacity first; ties by index.
std::vector<uint32_t> ByImportance(const GaussianModel& model) {
  std::vector<float> importance(model.size());
  for (size_t i = 0; i < model.size(); ++i) {
    const float* s = model.log_scale.data() + 3 * i;
    importance[i] = s[0] + s[1] + s[2] + std::log(Opacity(model.opacity_logit[i]) + 1e-30f);
  }
  std::vector<uint32_t> order(model.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t x, uint32_t y) {
    return importance[x] > importance[y];
  });
  return order;
}

}  // namespace

ExportFrame ExportFrameOf(const Scene& scene) {
  ExportFrame frame;
  frame.scale = scene.world_from_scene_scale;
  const double extent = scene.world_from_scene_scale * scene.Extent();
  const double rounding = kFloatHalfUlp * scene.world_offset.cwiseAbs().maxCoeff();
  (rounding <= kMaxRoundingOfExtent * extent ? frame.offset : frame.left_out) = scene.world_offset;
  return frame;
}

std::string EncodeGaussianPly(const GaussianModel& model,
                              const RgbHarmonics& rgb,
                              const ExportFrame& frame,
                              ThreadPool& pool,
                              bool with_confidence) {
  CheckColors(model, rgb);
  const int coefficients = ShCoefficients(rgb.degree);
  const size_t row_floats =
      17 + 3 * static_cast<size_t>(coefficients - 1) + (with_confidence ? 1 : 0);
  const float log_scale_shift = static_cast<float>(std::log(frame.scale));
  std::vector<float> rows(model.size() * row_floats, 0.0f);  // normals stay zero
  pool.ForRanges(static_cast<int64_t>(model.size()), [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) {
      float* out = rows.data() + i * row_floats;
      FilePosition(model, frame, i, out);
      out += 6;
      const float* sh = rgb.sh.data() + i * coefficients * 3;
      for (int c = 0; c < 3; ++c) *out++ = sh[c];
      for (int c = 0; c < 3; ++c) {
        for (int k = 1; k < coefficients; ++k) *out++ = sh[3 * k + c];
      }
      *out++ = model.opacity_logit[i];
      for (int k = 0; k < 3; ++k) *out++ = model.log_scale[3 * i + k] + log_scale_shift;
      FileRotation(model, i, out);
      if (with_confidence && !model.confidence.empty()) out[4] = model.confidence[i];
    }
  });
  std::string bytes = PlyHeader(model.size(), coefficients, with_confidence, frame);
  bytes.append(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(float));
  return bytes;
}

std::string EncodeSplat(const GaussianModel& model,
                        const RgbHarmonics& rgb,
                        const ExportFrame& frame) {
  CheckColors(model, rgb);
  const int coefficients = ShCoefficients(rgb.degree);
  std::string bytes(model.size() * kSplatBytes, '\0');
  char* out = bytes.data();
  for (const uint32_t i : ByImportance(model)) {
    float floats[6], rotation[4];
    FilePosition(model, frame, i, floats);
    for (int k = 0; k < 3; ++k) {
      floats[3 + k] = static_cast<float>(frame.scale * std::exp(model.log_scale[3 * i + k]));
    }
    FileRotation(model, i, rotation);
    uint8_t tail[8];
    const float* sh = rgb.sh.data() + static_cast<size_t>(i) * coefficients * 3;
    for (int c = 0; c < 3; ++c) tail[c] = Byte(255.0f * (0.5f + kShDc * sh[c]));
    tail[3] = Byte(255.0f * Opacity(model.opacity_logit[i]));
    for (int k = 0; k < 4; ++k) tail[4 + k] = Byte(128.0f + 128.0f * rotation[k]);
    std::memcpy(out, floats, sizeof(floats));
    std::memcpy(out + sizeof(floats), tail, sizeof(tail));
    out += kSplatBytes;
  }
  return bytes;
}

}  // namespace color3d
