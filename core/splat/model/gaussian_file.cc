#include <bit>
#include <cmath>
#include <cstring>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian");

constexpr char kMagic[8] = {'C', '3', 'D', 'G', 'A', 'U', 'S', 'S'};
constexpr uint32_t kPlainVersion = 1;
constexpr uint32_t kConfidenceVersion = 2;  // confidence is the last buffer
constexpr size_t kDigestBytes = 64;         // hexadecimal SHA-256 of all that stands before it

struct Header {
  char magic[8];
  uint32_t version;
  uint32_t channels;
  uint32_t sh_degree;
  uint32_t chroma_sh_degree;
  uint64_t count;
};
static_assert(sizeof(Header) == 32);

template <class Model, class Visit>
void ForEachBuffer(Model& m, bool with_confidence, Visit&& visit) {
  const int chroma = m.channels == 3 ? ShCoefficients(m.chroma_sh_degree) : 0;
  visit("position", m.position, 3);
  visit("log_scale", m.log_scale, 3);
  visit("rotation", m.rotation, 4);
  visit("opacity_logit", m.opacity_logit, 1);
  visit("sh_l", m.sh_l, ShCoefficients(m.sh_degree));
  visit("sh_a", m.sh_a, chroma);
  visit("sh_b", m.sh_b, chroma);
  if (with_confidence) visit("confidence", m.confidence, 1);
}

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
  if (h.version != kPlainVersion && h.version != kConfidenceVersion) {
    throw Refuse("version {}; this program reads versions {} and {}, update it",
                 h.version,
                 kPlainVersion,
                 kConfidenceVersion);
  }
  if ((h.channels != 1 && h.channels != 3) || h.sh_degree > 3 || h.chroma_sh_degree > 3) {
    throw Refuse("channels {} or a degree is out of range", h.channels);
  }
  return h;
}

}  // namespace

std::string SerializeGaussians(const GaussianModel& model) {
  CheckModel(model);
  Header h{};
  std::memcpy(h.magic, kMagic, sizeof(kMagic));
  const bool with_confidence = !model.confidence.empty();
  h.version = with_confidence ? kConfidenceVersion : kPlainVersion;
  h.channels = static_cast<uint32_t>(model.channels);
  h.sh_degree = static_cast<uint32_t>(model.sh_degree);
  h.chroma_sh_degree = static_cast<uint32_t>(model.chroma_sh_degree);
  h.count = model.size();
  std::string bytes(reinterpret_cast<const char*>(&h), sizeof(h));
  const auto append = [&](const char* name, const std::vector<float>& buffer, int width) {
    const std::string place = FirstNotFinite(name, buffer, width);
    if (!place.empty()) {
      throw Error(
          ErrorCode::kInternal, "a Gaussian model was to be saved whose {} is not finite", place);
    }
    bytes.append(reinterpret_cast<const char*>(buffer.data()), buffer.size() * sizeof(float));
  };
  ForEachBuffer(model, with_confidence, append);
  return bytes + Sha256Hex(bytes);
}

GaussianModel ParseGaussians(std::string_view bytes) {
  const Header h = ReadHeader(bytes);
  GaussianModel model;
  model.channels = static_cast<int>(h.channels);
  model.sh_degree = static_cast<int>(h.sh_degree);
  model.chroma_sh_degree = static_cast<int>(h.chroma_sh_degree);
  size_t floats_each = 0;
  const bool with_confidence = h.version == kConfidenceVersion;
  ForEachBuffer(model, with_confidence, [&](const char*, std::vector<float>&, int width) {
    floats_each += width;
  });
  const size_t body = bytes.size() - sizeof(Header) - kDigestBytes;
  const size_t bytes_each = floats_each * sizeof(float);
  if (body % bytes_each != 0 || body / bytes_each != h.count) {
    throw Refuse(
        "it claims {} Gaussians but holds {} bytes of them; it may be truncated", h.count, body);
  }
  const std::string_view content = bytes.substr(0, bytes.size() - kDigestBytes);
  if (Sha256Hex(content) != bytes.substr(content.size())) throw Refuse("the checksum is wrong");
  const char* next = bytes.data() + sizeof(Header);
  ForEachBuffer(model, with_confidence, [&](const char* name, auto& buffer, int width) {
    buffer.resize(static_cast<size_t>(h.count) * width);
    std::memcpy(buffer.data(), next, buffer.size() * sizeof(float));
    next += buffer.size() * sizeof(float);
    const std::string place = FirstNotFinite(name, buffer, width);
    if (!place.empty()) throw Refuse("the {} is not finite", place);
  });
  CheckModel(model);
  return model;
}

}  // namespace color3d
