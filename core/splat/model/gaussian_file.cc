#include <bit>
#include <cmath>
#include <cstring>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/model_buffers.h"
#include "core/splat/model/model_parameters.h"

namespace color3d {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian");

constexpr char kMagic[8] = {'C', '3', 'D', 'G', 'A', 'U', 'S', 'S'};
constexpr uint32_t kPlainVersion = 1;
constexpr uint32_t kConfidenceVersion = 2;  // confidence is the last buffer
constexpr uint32_t kMotionVersion = 3;      // a MotionHeader follows the header, motion is the last
constexpr uint32_t kSrgbVersion = 4;        // as version 3, of 0 or more moving Gaussians, in sRGB
constexpr size_t kDigestBytes = 64;         // hexadecimal SHA-256 of all bytes before it

struct Header {
  char magic[8];
  uint32_t version;
  uint32_t channels;
  uint32_t sh_degree;
  uint32_t chroma_sh_degree;
  uint64_t count;
};
static_assert(sizeof(Header) == 32);

struct MotionHeader {
  uint64_t moving;  // Gaussians, at most the header's count
  double begin_s;
  double end_s;
  uint64_t with_confidence;  // 0 or 1
};
static_assert(sizeof(MotionHeader) == 32);

template <class... Parts>
Error Refuse(fmt::format_string<Parts...> why, Parts&&... parts) {
  return InvalidArgument("not a usable Gaussian file: " +
                         fmt::format(why, std::forward<Parts>(parts)...));
}

// "position of Gaussian 7" for the first value that is not finite, or "".
std::string FirstNotFinite(const char* name, const std::vector<float>& buffer, int width) {
  for (size_t i = 0; i < buffer.size(); ++i) {
    if (!std::isfinite(buffer[i])) {
      return fmt::format("{} of Gaussian {}", name, i / static_cast<size_t>(width));
    }
  }
  return "";
}

Header ReadHeader(std::string_view bytes) {
  Header h;
  if (bytes.size() < sizeof(h) + kDigestBytes) {
    throw Refuse("it has only {} bytes", bytes.size());
  }
  std::memcpy(&h, bytes.data(), sizeof(h));
  if (std::memcmp(h.magic, kMagic, sizeof(kMagic)) != 0) {
    throw Refuse("it does not begin with C3DGAUSS");
  }
  if (h.version < kPlainVersion || h.version > kSrgbVersion) {
    throw Refuse("version {}; this program reads versions {} to {}, update it",
                 h.version,
                 kPlainVersion,
                 kSrgbVersion);
  }
  if ((h.channels != 1 && h.channels != 3) || h.sh_degree > 3 || h.chroma_sh_degree > 3 ||
      (h.version == kSrgbVersion && h.channels != 3)) {
    throw Refuse("channels {} or a degree is out of range", h.channels);
  }
  return h;
}

MotionHeader ReadMotionHeader(std::string_view bytes, const Header& h) {
  MotionHeader m{0, 0.0, 0.0, h.version == kConfidenceVersion ? 1u : 0u};
  if (h.version < kMotionVersion) return m;
  if (bytes.size() < sizeof(h) + sizeof(m) + kDigestBytes) {
    throw Refuse("it has only {} bytes", bytes.size());
  }
  std::memcpy(&m, bytes.data() + sizeof(h), sizeof(m));
  if ((m.moving == 0 && h.version == kMotionVersion) || m.moving > h.count ||
      m.with_confidence > 1 || !std::isfinite(m.begin_s) || !std::isfinite(m.end_s) ||
      m.begin_s > m.end_s) {
    throw Refuse(
        "its motion of {} Gaussians from {} s to {} s is invalid", m.moving, m.begin_s, m.end_s);
  }
  return m;
}

}  // namespace

std::string SerializeGaussians(const GaussianModel& model) {
  CheckModel(model);
  Header h{};
  std::memcpy(h.magic, kMagic, sizeof(kMagic));
  const bool with_confidence = !model.confidence.empty();
  const MotionHeader m{
      model.motion.size(), model.motion.begin_s, model.motion.end_s, with_confidence ? 1u : 0u};
  h.version = model.color_space == ColorSpace::kSrgb ? kSrgbVersion
              : m.moving > 0                         ? kMotionVersion
              : with_confidence                      ? kConfidenceVersion
                                                     : kPlainVersion;
  h.channels = static_cast<uint32_t>(model.channels);
  h.sh_degree = static_cast<uint32_t>(model.sh_degree);
  h.chroma_sh_degree = static_cast<uint32_t>(model.chroma_sh_degree);
  h.count = model.size();
  std::string bytes(reinterpret_cast<const char*>(&h), sizeof(h));
  if (h.version >= kMotionVersion) bytes.append(reinterpret_cast<const char*>(&m), sizeof(m));
  const auto append = [&](const char* name, const std::vector<float>& buffer, int width, size_t) {
    const std::string place = FirstNotFinite(name, buffer, width);
    if (!place.empty()) {
      throw Error(
          ErrorCode::kInternal, "the {} of a Gaussian model to be saved is not finite", place);
    }
    bytes.append(reinterpret_cast<const char*>(buffer.data()), buffer.size() * sizeof(float));
  };
  ForEachBuffer(model, model.size(), model.motion.size(), with_confidence, append);
  return bytes + Sha256Hex(bytes);
}

GaussianModel ParseGaussians(std::string_view bytes) {
  const Header h = ReadHeader(bytes);
  GaussianModel model;
  if (h.version == kSrgbVersion) model.color_space = ColorSpace::kSrgb;
  model.channels = static_cast<int>(h.channels);
  model.sh_degree = static_cast<int>(h.sh_degree);
  model.chroma_sh_degree = static_cast<int>(h.chroma_sh_degree);
  const MotionHeader m = ReadMotionHeader(bytes, h);
  const size_t head = sizeof(Header) + (h.version >= kMotionVersion ? sizeof(MotionHeader) : 0);
  const size_t body = bytes.size() - head - kDigestBytes;
  // No product of a number from the file may overflow.
  size_t floats_left = body / sizeof(float);
  bool fits = body % sizeof(float) == 0;
  const auto count = [&](const char*, std::vector<float>&, int width, size_t each) {
    fits = fits && (width == 0 || each <= floats_left / static_cast<size_t>(width));
    if (fits) floats_left -= each * static_cast<size_t>(width);
  };
  ForEachBuffer(model, h.count, m.moving, m.with_confidence == 1, count);
  if (!fits || floats_left != 0) {
    throw Refuse(
        "it claims {} Gaussians but holds {} bytes of them; it may be truncated", h.count, body);
  }
  const std::string_view content = bytes.substr(0, bytes.size() - kDigestBytes);
  if (Sha256Hex(content) != bytes.substr(content.size())) throw Refuse("the checksum is wrong");
  model.motion.begin_s = m.begin_s;
  model.motion.end_s = m.end_s;
  const char* next = bytes.data() + head;
  const auto read = [&](const char* name, std::vector<float>& buffer, int width, size_t each) {
    buffer.resize(each * static_cast<size_t>(width));
    std::memcpy(buffer.data(), next, buffer.size() * sizeof(float));
    next += buffer.size() * sizeof(float);
    const std::string place = FirstNotFinite(name, buffer, width);
    if (!place.empty()) throw Refuse("the {} is not finite", place);
  };
  ForEachBuffer(model, h.count, m.moving, m.with_confidence == 1, read);
  CheckModel(model);
  return model;
}

}  // namespace color3d
