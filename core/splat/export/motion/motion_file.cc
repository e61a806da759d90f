#include "core/splat/export/motion/motion_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/base/bytes/little_endian.h"
#include "core/base/error.h"

namespace color3d {
namespace {

constexpr std::string_view kMotionMagic = "C3DMOVES";
constexpr uint32_t kMotionVersion = 1;
constexpr size_t kMotionHeaderBytes = 72;
constexpr size_t kBytesOfMover = 20;
// exp(-kWindowEnd^2 / 2) is just below the opacity that is drawn.
constexpr float kWindowEnd = 4.3f;
constexpr float kNarrowest = -11.5f, kWidest = 3.5f;  // logarithm of the width
constexpr float kWords = 65535.0f;                    // of 16 bits
constexpr float kWidthSteps = 65534.0f;               // code 0 is not a width
constexpr float kPathSteps = 32767.0f;
constexpr float kTurnSteps = 127.0f;

struct Span {
  float low = 0.0f;
  float high = 0.0f;

  float At(float share) const { return low + (high - low) * share; }
  float ShareOf(float value) const { return high > low ? (value - low) / (high - low) : 0.0f; }
};

Span SpanOf(const std::vector<float>& values) {
  if (values.empty()) return {};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}

float LargestOf(const std::vector<float>& values) {
  float most = 0.0f;
  for (const float v : values) most = std::max(most, std::abs(v));
  return most;
}

// Steps are finer around zero: value = most s |s| with s = code / steps.
int SquareCode(float value, float most, float steps) {
  if (most <= 0.0f) return 0;
  const float root = std::sqrt(std::min(1.0f, std::abs(value) / most));
  return static_cast<int>(std::lround(std::copysign(root, value) * steps));
}
float FromSquareCode(int code, float most, float steps) {
  const float s = static_cast<float>(code) / steps;
  return most * s * std::abs(s);
}

float CenterOf(uint16_t code, const Span& span) {
  return span.At(static_cast<float>(code) / kWords);
}
float LogWidthOf(uint16_t code, const Span& span) {
  return span.At((static_cast<float>(code) - 1.0f) / kWidthSteps);
}

// All low bytes, then all high ones: similar bytes are adjacent.
void PutWords(const std::vector<uint16_t>& words, std::string* out) {
  for (const unsigned shift : {0u, 8u}) {
    for (const uint16_t w : words) out->push_back(static_cast<char>(w >> shift & 0xffu));
  }
}

// The columns of an n-wide buffer of codes, one after the other.
std::vector<uint16_t> Column(const std::vector<int>& codes, size_t width, size_t column) {
  std::vector<uint16_t> words(codes.size() / width);
  for (size_t i = 0; i < words.size(); ++i) {
    words[i] = static_cast<uint16_t>(static_cast<int16_t>(codes[i * width + column]));
  }
  return words;
}

std::vector<int> SquareCodes(const std::vector<float>& values, float most, float steps) {
  std::vector<int> codes(values.size());
  std::transform(values.begin(), values.end(), codes.begin(), [&](float v) {
    return SquareCode(v, most, steps);
  });
  return codes;
}

void CheckMoving(const MovingGaussians& m) {
  const auto check = [&](const char* what, const std::vector<float>& values, size_t width) {
    if (values.size() != width * m.size()) {
      throw InvalidArgument("the motion has {} numbers of {} for {} Gaussians; {} are needed",
                            values.size(),
                            what,
                            m.size(),
                            width * m.size());
    }
    const auto bad =
        std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
    if (bad == values.end()) return;
    throw InvalidArgument("the {} of moving Gaussian {} is not a finite number; leave it out",
                          what,
                          static_cast<size_t>(bad - values.begin()) / width);
  };
  check("center", m.center, 1);
  check("log_width", m.log_width, 1);
  check("velocity", m.velocity, 3);
  check("acceleration", m.acceleration, 3);
  check("spin", m.spin, 4);
  for (size_t i = 0; i < m.size(); ++i) {
    if (m.index[i] >= m.total || (i > 0 && m.index[i] <= m.index[i - 1])) {
      throw InvalidArgument(
          "moving Gaussian {} has place {} of {}; places must ascend", i, m.index[i], m.total);
    }
  }
  if (!std::isfinite(m.begin_s) || !std::isfinite(m.end_s) || m.end_s < m.begin_s) {
    throw InvalidArgument(
        "the motion lasts from {} s to {} s; it must end after it begins", m.begin_s, m.end_s);
  }
}

Error RefuseMotion(const std::string& why) {
  return InvalidArgument("the motion of the scene cannot be read: {}; export the scene again", why);
}

class MotionReader {
 public:
  explicit MotionReader(std::string_view bytes) : bytes_(bytes) {}

  uint64_t Number(int width) {
    uint64_t value = 0;
    for (int k = 0; k < width; ++k) value |= uint64_t{Byte()} << (8 * k);
    return value;
  }
  float Float() { return std::bit_cast<float>(static_cast<uint32_t>(Number(4))); }
  double Double() { return std::bit_cast<double>(Number(8)); }
  uint8_t Byte() { return static_cast<uint8_t>(bytes_[at_++]); }
  std::vector<uint16_t> Words(size_t count) {
    std::vector<uint16_t> words(count, 0);
    for (const unsigned shift : {0u, 8u}) {
      for (uint16_t& w : words) w = static_cast<uint16_t>(w | unsigned{Byte()} << shift);
    }
    return words;
  }
  // Motion from its end, in units of `unit`.
  std::vector<float> Path(size_t count, float most) {
    std::vector<float> values(3 * count);
    for (size_t k = 0; k < 3; ++k) {
      const std::vector<uint16_t> words = Words(count);
      for (size_t i = 0; i < count; ++i) {
        values[3 * i + k] = FromSquareCode(static_cast<int16_t>(words[i]), most, kPathSteps);
      }
    }
    return values;
  }

 private:
  std::string_view bytes_;
  size_t at_ = 0;
};

}  // namespace

float MotionReach(float center, float log_width) {
  return std::min(kWindowEnd * std::exp(log_width), 1.0f + std::abs(center));
}

std::string EncodeMotion(const MovingGaussians& moving) {
  CheckMoving(moving);
  const size_t count = moving.size();
  std::vector<float> log_width = moving.log_width;
  for (float& w : log_width) w = std::clamp(w, kNarrowest, kWidest);
  const Span centers = SpanOf(moving.center), widths = SpanOf(log_width);
  std::vector<uint16_t> center(count), width(count);
  std::vector<float> velocity = moving.velocity, acceleration = moving.acceleration;
  std::vector<float> spin = moving.spin;
  for (size_t i = 0; i < count; ++i) {
    center[i] = static_cast<uint16_t>(std::lround(kWords * centers.ShareOf(moving.center[i])));
    width[i] = static_cast<uint16_t>(1 + std::lround(kWidthSteps * widths.ShareOf(log_width[i])));
    // As a reader knows it.
    const float reach = MotionReach(CenterOf(center[i], centers), LogWidthOf(width[i], widths));
    for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
      velocity[k] *= reach;
      acceleration[k] *= reach * reach;
    }
    for (size_t k = 4 * i; k < 4 * i + 4; ++k) spin[k] *= reach;
  }
  const float path = LargestOf(velocity), bend = LargestOf(acceleration), turn = LargestOf(spin);
  if (!std::isfinite(path) || !std::isfinite(bend) || !std::isfinite(turn)) {
    throw InvalidArgument("a Gaussian moves farther than numbers reach; leave it out");
  }

  std::string out(kMotionMagic);
  PutLittleEndian(kMotionVersion, 4, &out);
  PutLittleEndian(moving.total, 4, &out);
  PutLittleEndian(count, 4, &out);
  PutLittleEndian(0, 4, &out);
  PutLittleEndian(std::bit_cast<uint64_t>(moving.begin_s), 8, &out);
  PutLittleEndian(std::bit_cast<uint64_t>(moving.end_s), 8, &out);
  for (const float v : {centers.low, centers.high, widths.low, widths.high, path, bend, turn}) {
    PutLittleEndian(std::bit_cast<uint32_t>(v), 4, &out);
  }
  PutLittleEndian(0, 4, &out);
  std::string mask((moving.total + 7) / 8, '\0');
  for (const uint32_t i : moving.index) mask[i / 8] = static_cast<char>(mask[i / 8] | 1 << i % 8);
  out += mask;
  PutWords(center, &out);
  PutWords(width, &out);
  const std::vector<int> path_codes = SquareCodes(velocity, path, kPathSteps);
  const std::vector<int> bend_codes = SquareCodes(acceleration, bend, kPathSteps);
  const std::vector<int> turn_codes = SquareCodes(spin, turn, kTurnSteps);
  for (size_t k = 0; k < 3; ++k) PutWords(Column(path_codes, 3, k), &out);
  for (size_t k = 0; k < 3; ++k) PutWords(Column(bend_codes, 3, k), &out);
  for (size_t k = 0; k < 4; ++k) {
    for (size_t i = 0; i < count; ++i) out.push_back(static_cast<char>(turn_codes[4 * i + k]));
  }
  return out;
}

MovingGaussians DecodeMotion(std::string_view bytes) {
  if (bytes.size() < kMotionHeaderBytes || !bytes.starts_with(kMotionMagic)) {
    throw RefuseMotion("it does not begin as such a file");
  }
  MotionReader in(bytes);
  in.Number(8);
  const auto version = static_cast<uint32_t>(in.Number(4));
  if (version != kMotionVersion) {
    throw RefuseMotion(fmt::format("it has version {}, and 1 is known", version));
  }
  MovingGaussians m;
  m.total = static_cast<uint32_t>(in.Number(4));
  const size_t count = in.Number(4), mask_bytes = (size_t{m.total} + 7) / 8;
  if (in.Number(4) != 0) throw RefuseMotion("byte 20 is not 0");
  m.begin_s = in.Double();
  m.end_s = in.Double();
  Span centers, widths;
  float path = 0.0f, bend = 0.0f, turn = 0.0f;
  for (float* v : {&centers.low, &centers.high, &widths.low, &widths.high, &path, &bend, &turn}) {
    *v = in.Float();
    if (!std::isfinite(*v)) throw RefuseMotion("its header has a number that is not finite");
  }
  if (in.Number(4) != 0) throw RefuseMotion("byte 68 is not 0");
  if (!std::isfinite(m.begin_s) || !std::isfinite(m.end_s) || m.end_s < m.begin_s ||
      centers.high < centers.low || widths.high < widths.low || path < 0 || bend < 0 || turn < 0) {
    throw RefuseMotion("its header has a range that ends before it begins");
  }
  const size_t wanted = kMotionHeaderBytes + mask_bytes + kBytesOfMover * count;
  if (count > m.total || bytes.size() != wanted) {
    throw RefuseMotion(fmt::format("it has {} bytes, and {} of {} Gaussians that move need {}",
                                   bytes.size(),
                                   count,
                                   m.total,
                                   wanted));
  }
  for (size_t byte = 0; byte < mask_bytes; ++byte) {
    const unsigned bits = in.Byte();
    for (unsigned k = 0; k < 8; ++k) {
      if (bits >> k & 1u) m.index.push_back(static_cast<uint32_t>(8 * byte + k));
    }
  }
  if (m.index.size() != count || (count > 0 && m.index.back() >= m.total)) {
    throw RefuseMotion(fmt::format("it marks {} Gaussians, not {}", m.index.size(), count));
  }
  for (const uint16_t code : in.Words(count)) m.center.push_back(CenterOf(code, centers));
  for (const uint16_t code : in.Words(count)) {
    if (code == 0) throw RefuseMotion("a Gaussian has no window of time");
    m.log_width.push_back(LogWidthOf(code, widths));
  }
  m.velocity = in.Path(count, path);
  m.acceleration = in.Path(count, bend);
  m.spin.resize(4 * count);
  for (size_t k = 0; k < 4; ++k) {
    for (size_t i = 0; i < count; ++i) {
      m.spin[4 * i + k] = FromSquareCode(static_cast<int8_t>(in.Byte()), turn, kTurnSteps);
    }
  }
  for (size_t i = 0; i < count; ++i) {
    const float reach = MotionReach(m.center[i], m.log_width[i]);
    for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
      m.velocity[k] /= reach;
      m.acceleration[k] /= reach * reach;
    }
    for (size_t k = 4 * i; k < 4 * i + 4; ++k) m.spin[k] /= reach;
  }
  return m;
}

}  // namespace color3d
