#include <algorithm>
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
constexpr uint32_t kFieldVersion = 5;  // a FieldHeader follows the header, the field is the last
constexpr size_t kDigestBytes = 64;    // hexadecimal SHA-256 of all bytes before it

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

struct FieldHeader {
  double begin_s;
  double end_s;
  float low[3];
  float high[3];
  float extent;
  uint32_t features;
  uint32_t width;
  uint32_t levels;
  uint32_t space_samples[kMaxHexPlaneLevels];
  uint32_t time_samples[kMaxHexPlaneLevels];
  uint32_t with_confidence;  // 0 or 1
  uint32_t in_srgb;          // 0 or 1
};
static_assert(sizeof(FieldHeader) == 96);

template <class... Parts>
Error Refuse(fmt::format_string<Parts...> why, Parts&&... parts) {
  return InvalidArgument("not a usable Gaussian file: " +
                         fmt::format(why, std::forward<Parts>(parts)...));
}

// "position of Gaussian 7" for the first value that is not finite, or "".
std::string FirstNotFinite(const std::string& name, const std::vector<float>& buffer, int width) {
  for (size_t i = 0; i < buffer.size(); ++i) {
    if (!std::isfinite(buffer[i])) {
      return fmt::format("{} {}", name, i / static_cast<size_t>(width));
    }
  }
  return "";
}

std::string OfGaussian(const char* name) { return std::string(name) + " of Gaussian"; }

void Append(const std::string& name,
            const std::vector<float>& buffer,
            int width,
            std::string* bytes) {
  const std::string place = FirstNotFinite(name, buffer, width);
  if (!place.empty()) {
    throw Error(
        ErrorCode::kInternal, "the {} of a Gaussian model to be saved is not finite", place);
  }
  bytes->append(reinterpret_cast<const char*>(buffer.data()), buffer.size() * sizeof(float));
}

// Reads `count` floats and moves `next` behind them.
void ReadFloats(const std::string& name,
                int width,
                size_t count,
                const char** next,
                std::vector<float>* buffer) {
  buffer->resize(count);
  std::memcpy(buffer->data(), *next, count * sizeof(float));
  *next += count * sizeof(float);
  const std::string place = FirstNotFinite(name, *buffer, width);
  if (!place.empty()) throw Refuse("the {} is not finite", place);
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
  if (h.version < kPlainVersion || h.version > kFieldVersion) {
    throw Refuse("version {}; this program reads versions {} to {}, update it",
                 h.version,
                 kPlainVersion,
                 kFieldVersion);
  }
  if ((h.channels != 1 && h.channels != 3) || h.sh_degree > 3 || h.chroma_sh_degree > 3 ||
      (h.version == kSrgbVersion && h.channels != 3)) {
    throw Refuse("channels {} or a degree is out of range", h.channels);
  }
  return h;
}

bool HasMotionHeader(const Header& h) {
  return h.version == kMotionVersion || h.version == kSrgbVersion;
}

MotionHeader ReadMotionHeader(std::string_view bytes, const Header& h) {
  MotionHeader m{0, 0.0, 0.0, h.version == kConfidenceVersion ? 1u : 0u};
  if (!HasMotionHeader(h)) return m;
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

FieldHeader FieldHeaderOf(const GaussianModel& model, bool with_confidence) {
  const HexPlaneShape& shape = model.hexplane.shape;
  FieldHeader f{};
  f.begin_s = shape.begin_s;
  f.end_s = shape.end_s;
  std::ranges::copy(shape.low, f.low);
  std::ranges::copy(shape.high, f.high);
  f.extent = shape.extent;
  f.features = static_cast<uint32_t>(shape.features);
  f.width = static_cast<uint32_t>(shape.width);
  f.levels = static_cast<uint32_t>(shape.levels.size());
  for (size_t k = 0; k < shape.levels.size(); ++k) {
    f.space_samples[k] = static_cast<uint32_t>(shape.levels[k].space);
    f.time_samples[k] = static_cast<uint32_t>(shape.levels[k].time);
  }
  f.with_confidence = with_confidence ? 1 : 0;
  f.in_srgb = model.color_space == ColorSpace::kSrgb ? 1 : 0;
  return f;
}

// Sets the field's shape and the colour space. Returns true if the model has confidence.
bool ReadFieldHeader(std::string_view bytes, const Header& h, GaussianModel* model) {
  FieldHeader f;
  HexPlaneShape* shape = &model->hexplane.shape;
  if (bytes.size() < sizeof(Header) + sizeof(f) + kDigestBytes) {
    throw Refuse("it has only {} bytes", bytes.size());
  }
  std::memcpy(&f, bytes.data() + sizeof(Header), sizeof(f));
  shape->begin_s = f.begin_s;
  shape->end_s = f.end_s;
  std::ranges::copy(f.low, shape->low.begin());
  std::ranges::copy(f.high, shape->high.begin());
  shape->extent = f.extent;
  shape->features = static_cast<int>(f.features);
  shape->width = static_cast<int>(f.width);
  for (uint32_t k = 0; k < std::min<uint32_t>(f.levels, kMaxHexPlaneLevels); ++k) {
    shape->levels.push_back(
        {static_cast<int>(f.space_samples[k]), static_cast<int>(f.time_samples[k])});
  }
  const std::string complaint = f.levels > kMaxHexPlaneLevels ? "too many levels"
                                : f.with_confidence > 1 || f.in_srgb > (h.channels == 3 ? 1 : 0)
                                    ? "a flag is out of range"
                                    : shape->Complaint();
  if (!complaint.empty()) throw Refuse("its deformation field: {}", complaint);
  if (f.in_srgb == 1) model->color_space = ColorSpace::kSrgb;
  return f.with_confidence == 1;
}

// Calls visit(name, buffer, count) for the numbers of the field.
template <class Field, class Visit>
void ForEachFieldBuffer(Field& field, Visit&& visit) {
  visit("deformation plane number", field.planes, field.shape.PlaneFloats());
  visit("deformation network number", field.network, field.shape.NetworkFloats());
}

}  // namespace

std::string SerializeGaussians(const GaussianModel& model) {
  CheckModel(model);
  Header h{};
  std::memcpy(h.magic, kMagic, sizeof(kMagic));
  const bool with_confidence = !model.confidence.empty();
  const MotionHeader m{
      model.motion.size(), model.motion.begin_s, model.motion.end_s, with_confidence ? 1u : 0u};
  const bool with_field = !model.hexplane.empty();
  h.version = with_field                               ? kFieldVersion
              : model.color_space == ColorSpace::kSrgb ? kSrgbVersion
              : m.moving > 0                           ? kMotionVersion
              : with_confidence                        ? kConfidenceVersion
                                                       : kPlainVersion;
  h.channels = static_cast<uint32_t>(model.channels);
  h.sh_degree = static_cast<uint32_t>(model.sh_degree);
  h.chroma_sh_degree = static_cast<uint32_t>(model.chroma_sh_degree);
  h.count = model.size();
  std::string bytes(reinterpret_cast<const char*>(&h), sizeof(h));
  if (HasMotionHeader(h)) bytes.append(reinterpret_cast<const char*>(&m), sizeof(m));
  if (with_field) {
    const FieldHeader f = FieldHeaderOf(model, with_confidence);
    bytes.append(reinterpret_cast<const char*>(&f), sizeof(f));
  }
  const auto append = [&](const char* name, const std::vector<float>& buffer, int width, size_t) {
    Append(OfGaussian(name), buffer, width, &bytes);
  };
  ForEachBuffer(model, model.size(), model.motion.size(), with_confidence, append);
  if (with_field) {
    ForEachFieldBuffer(model.hexplane, [&](const char* name, const auto& buffer, size_t) {
      Append(name, buffer, 1, &bytes);
    });
  }
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
  const bool with_field = h.version == kFieldVersion;
  const bool with_confidence =
      with_field ? ReadFieldHeader(bytes, h, &model) : m.with_confidence == 1;
  const size_t head = sizeof(Header) + (with_field           ? sizeof(FieldHeader)
                                        : HasMotionHeader(h) ? sizeof(MotionHeader)
                                                             : 0);
  const size_t body = bytes.size() - head - kDigestBytes;
  // No product of a number from the file may overflow.
  size_t floats_left = body / sizeof(float);
  bool fits = body % sizeof(float) == 0;
  const auto count = [&](const char*, std::vector<float>&, int width, size_t each) {
    fits = fits && (width == 0 || each <= floats_left / static_cast<size_t>(width));
    if (fits) floats_left -= each * static_cast<size_t>(width);
  };
  ForEachBuffer(model, h.count, m.moving, with_confidence, count);
  if (with_field) {
    ForEachFieldBuffer(model.hexplane, [&](const char* name, std::vector<float>& buffer, size_t n) {
      count(name, buffer, 1, n);
    });
  }
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
    ReadFloats(OfGaussian(name), width, each * static_cast<size_t>(width), &next, &buffer);
  };
  ForEachBuffer(model, h.count, m.moving, with_confidence, read);
  if (with_field) {
    ForEachFieldBuffer(model.hexplane, [&](const char* name, std::vector<float>& buffer, size_t n) {
      ReadFloats(name, 1, n, &next, &buffer);
    });
  }
  CheckModel(model);
  return model;
}

}  // namespace color3d
