#include "core/splat/export/spz/spz.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/bytes/little_endian.h"
#include "core/base/error.h"
#include "core/splat/export/bytes.h"
#include "core/splat/export/morton.h"
#include "core/splat/export/zstd.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/zip/gzip.h"

namespace color3d {
namespace {

constexpr uint32_t kMagic = 0x5053474e;  // "NGSP"
constexpr uint32_t kHeaderBytes = 32;    // of version 4
constexpr int kMaxFractionalBits = 20;
constexpr double kPositionLimit = 8388607.0;  // 2^23 - 1
constexpr float kColorScale = 0.15f;
constexpr float kLowestLogScale = -10.0f;
constexpr float kScaleSteps = 16.0f;  // a unit of the logarithm
// Quantization steps in byte values; 128 byte values are one unit.
constexpr int kFirstDegreeStep = 8;
constexpr int kRestStep = 16;
constexpr std::array<float, 3> kFlip = {1.0f, -1.0f, -1.0f};

// The largest number of fractional bits with the farthest coordinate within 24 bits.
int FractionalBits(const std::vector<float>& position) {
  double farthest = 0.0;
  for (const float x : position) farthest = std::max(farthest, std::abs(static_cast<double>(x)));
  int bits = kMaxFractionalBits;
  while (bits >= 0 && std::ldexp(farthest, bits) > kPositionLimit) --bits;
  if (bits < 0) {
    throw InvalidArgument(
        "a coordinate of {} is out of the range of SPZ; move the scene to the origin", farthest);
  }
  return bits;
}

void CheckScales(const std::vector<float>& log_scale) {
  const float highest = kLowestLogScale + 255.0f / kScaleSteps;
  const auto outside = std::count_if(log_scale.begin(), log_scale.end(), [=](float s) {
    return s < kLowestLogScale || s > highest;
  });
  if (2 * static_cast<size_t>(outside) <= log_scale.size()) return;
  throw InvalidArgument(
      "most Gaussians are smaller than {:.1g} or larger than {:.0f} units, out of the range of "
      "SPZ; "
      "export another format",
      std::exp(kLowestLogScale),
      std::exp(highest));
}

std::string Positions(const ViewerGaussians& g, int fractional_bits) {
  std::string bytes;
  bytes.reserve(3 * g.position.size());
  for (size_t i = 0; i < g.position.size(); ++i) {
    const double fixed =
        std::ldexp(static_cast<double>(kFlip[i % 3] * g.position[i]), fractional_bits);
    const auto number = static_cast<uint32_t>(static_cast<int32_t>(std::lround(fixed)));
    for (const unsigned shift : {0u, 8u, 16u}) {
      bytes.push_back(static_cast<char>(number >> shift & 0xffu));
    }
  }
  return bytes;
}

std::string Opacities(const ViewerGaussians& g) {
  std::string bytes;
  for (const float logit : g.opacity_logit) bytes.push_back(static_cast<char>(OpacityByte(logit)));
  return bytes;
}

std::string Colors(const ViewerGaussians& g) {
  const size_t row = 3 * static_cast<size_t>(ShCoefficients(g.sh_degree));
  std::string bytes;
  for (size_t i = 0; i < g.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      bytes.push_back(static_cast<char>(Byte(255.0f * (0.5f + kColorScale * g.sh[i * row + c]))));
    }
  }
  return bytes;
}

std::string Scales(const ViewerGaussians& g) {
  std::string bytes;
  for (const float s : g.log_scale)
    bytes.push_back(static_cast<char>(Byte(kScaleSteps * (s - kLowestLogScale))));
  return bytes;
}

// x y z w, in the file's axes.
std::array<float, 4> FlippedRotation(const ViewerGaussians& g, size_t i) {
  const float* q = g.rotation.data() + 4 * i;
  return {q[1], -q[2], -q[3], q[0]};
}

// All components but the largest: a sign and 9 bits each, below the index of the largest.
std::string SmallestThree(const ViewerGaussians& g) {
  std::string bytes;
  for (size_t i = 0; i < g.size(); ++i) {
    const std::array<float, 4> q = FlippedRotation(g, i);
    unsigned largest = 0;
    for (unsigned k = 1; k < 4; ++k) {
      if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
    }
    uint32_t packed = largest;
    for (unsigned k = 0; k < 4; ++k) {
      if (k == largest) continue;
      const bool negative = (q[k] < 0.0f) != (q[largest] < 0.0f);
      const long magnitude = std::min(std::lround(511.0 * M_SQRT2 * std::abs(q[k])), 511l);
      packed = packed << 10u | (negative ? 512u : 0u) | static_cast<uint32_t>(magnitude);
    }
    PutLittleEndian(packed, 4, &bytes);
  }
  return bytes;
}

// x y z with positive w.
std::string FirstThree(const ViewerGaussians& g) {
  std::string bytes;
  for (size_t i = 0; i < g.size(); ++i) {
    const std::array<float, 4> q = FlippedRotation(g, i);
    const float factor = q[3] < 0.0f ? -127.5f : 127.5f;
    for (int k = 0; k < 3; ++k) bytes.push_back(static_cast<char>(Byte(127.5f + factor * q[k])));
  }
  return bytes;
}

// True for basis functions that change sign with the axes.
std::array<float, kMaxShCoefficients> FlippedSigns() {
  double here[kMaxShCoefficients], there[kMaxShCoefficients];
  EvaluateSh(kMaxShCoefficients, 0.36, 0.48, 0.8, here);  // a direction without zeros
  EvaluateSh(kMaxShCoefficients, 0.36, -0.48, -0.8, there);
  std::array<float, kMaxShCoefficients> signs;
  for (int k = 0; k < kMaxShCoefficients; ++k) signs[k] = here[k] * there[k] < 0.0 ? -1.0f : 1.0f;
  return signs;
}

std::string Harmonics(const ViewerGaussians& g) {
  const int coefficients = ShCoefficients(g.sh_degree);
  const std::array<float, kMaxShCoefficients> sign = FlippedSigns();
  std::string bytes;
  bytes.reserve(g.size() * 3 * static_cast<size_t>(coefficients - 1));
  const float* sh = g.sh.data();
  for (size_t i = 0; i < g.size(); ++i, sh += 3 * coefficients) {
    for (int k = 1; k < coefficients; ++k) {
      const auto step = static_cast<float>(k < 4 ? kFirstDegreeStep : kRestStep);
      for (int c = 0; c < 3; ++c) {
        const float value = std::clamp(sign[k] * sh[3 * k + c], -2.0f, 2.0f);
        bytes.push_back(static_cast<char>(Byte(128.0f + step * std::round(128.0f * value / step))));
      }
    }
  }
  return bytes;
}

// Spatial neighbours are similar and compress better together.
ViewerGaussians InMortonOrder(const ViewerGaussians& g) {
  const std::vector<uint32_t> order = MortonOrder(LogGridOf(g.position));
  const auto sorted = [&](const std::vector<float>& rows) {
    const size_t width = rows.size() / g.size();
    std::vector<float> out;
    out.reserve(rows.size());
    for (const size_t i : order) {
      out.insert(out.end(), rows.begin() + i * width, rows.begin() + (i + 1) * width);
    }
    return out;
  };
  return {g.sh_degree,
          sorted(g.position),
          sorted(g.log_scale),
          sorted(g.rotation),
          sorted(g.opacity_logit),
          sorted(g.sh)};
}

}  // namespace

std::string EncodeSpz(const ViewerGaussians& gaussians, SpzVersion version, ThreadPool& pool) {
  if (gaussians.size() == 0) {
    throw InvalidArgument("there are no Gaussians, and readers refuse an SPZ without any");
  }
  CheckFinite(gaussians);
  CheckScales(gaussians.log_scale);
  const ViewerGaussians g = InMortonOrder(gaussians);
  const int fractional_bits = FractionalBits(g.position);
  const bool zstd = version == SpzVersion::k4;
  std::vector<std::string> streams = {Positions(g, fractional_bits),
                                      Opacities(g),
                                      Colors(g),
                                      Scales(g),
                                      zstd ? SmallestThree(g) : FirstThree(g)};
  if (g.sh_degree > 0) streams.push_back(Harmonics(g));

  std::string file;
  PutLittleEndian(kMagic, 4, &file);
  PutLittleEndian(static_cast<uint32_t>(version), 4, &file);
  PutLittleEndian(g.size(), 4, &file);
  PutLittleEndian(static_cast<uint32_t>(g.sh_degree), 1, &file);
  PutLittleEndian(static_cast<uint32_t>(fractional_bits), 1, &file);
  PutLittleEndian(0, 1, &file);  // flags: trained without the antialiasing of Mip-Splatting
  if (!zstd) {
    PutLittleEndian(0, 1, &file);
    for (const std::string& stream : streams) file += stream;
    return Gzip(file);
  }
  PutLittleEndian(streams.size(), 1, &file);
  PutLittleEndian(kHeaderBytes, 4, &file);  // offset of the table of sizes
  file.resize(kHeaderBytes, '\0');
  std::vector<std::string> packed(streams.size());
  pool.ForEach(static_cast<int64_t>(streams.size()),
               [&](int64_t i, int) { packed[i] = Zstd(streams[i]); });
  for (size_t i = 0; i < streams.size(); ++i) {
    PutLittleEndian(packed[i].size(), 8, &file);
    PutLittleEndian(streams[i].size(), 8, &file);
  }
  for (const std::string& stream : packed) file += stream;
  return file;
}

}  // namespace color3d
