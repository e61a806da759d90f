#include "core/weights/element_type.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

namespace color3d {
namespace {

static_assert(std::endian::native == std::endian::little, "weight files are little-endian");

template <typename Stored>
void ConvertPlain(const char* bytes, uint64_t count, float* out) {
  for (uint64_t i = 0; i < count; ++i) {
    Stored value;
    std::memcpy(&value, bytes + i * sizeof(Stored), sizeof(Stored));
    out[i] = static_cast<float>(value);
  }
}

void ConvertHalf(const char* bytes, uint64_t count, float* out) {
  for (uint64_t i = 0; i < count; ++i) {
    uint16_t half;
    std::memcpy(&half, bytes + i * sizeof(half), sizeof(half));
    out[i] = FloatFromHalf(half);
  }
}

void ConvertBfloat16(const char* bytes, uint64_t count, float* out) {
  for (uint64_t i = 0; i < count; ++i) {
    uint16_t upper;
    std::memcpy(&upper, bytes + i * sizeof(upper), sizeof(upper));
    out[i] = std::bit_cast<float>(static_cast<uint32_t>(upper) << 16);
  }
}

void ConvertBool(const char* bytes, uint64_t count, float* out) {
  for (uint64_t i = 0; i < count; ++i) out[i] = bytes[i] != 0 ? 1.0f : 0.0f;
}

}  // namespace

int ElementBytes(ElementType type) {
  switch (type) {
    case ElementType::kInt8:
    case ElementType::kUint8:
    case ElementType::kBool:
      return 1;
    case ElementType::kFloat16:
    case ElementType::kBfloat16:
    case ElementType::kInt16:
    case ElementType::kUint16:
      return 2;
    case ElementType::kFloat32:
    case ElementType::kInt32:
    case ElementType::kUint32:
      return 4;
    case ElementType::kFloat64:
    case ElementType::kInt64:
    case ElementType::kUint64:
      return 8;
  }
  return 8;
}

// Without branches, so that the compiler makes vectors of it: the exponent is moved to its place
// and re-biased by a multiplication, which also normalises subnormal halves.
float FloatFromHalf(uint16_t half) {
  const uint32_t magnitude = half & 0x7fffu;
  const uint32_t sign = static_cast<uint32_t>(half & 0x8000u) << 16;
  constexpr float kRebias = 0x1p112f;  // 2^(127 - 15)
  const float finite = std::bit_cast<float>(magnitude << 13) * kRebias;
  const uint32_t special = magnitude >= 0x7c00u ? 0x7f800000u : 0u;  // infinity and NaN
  return std::bit_cast<float>(std::bit_cast<uint32_t>(finite) | special | sign);
}

uint16_t HalfFromFloat(float value) {
  const uint32_t bits = std::bit_cast<uint32_t>(value);
  const uint16_t sign = static_cast<uint16_t>((bits >> 16) & 0x8000u);
  const uint32_t magnitude = bits & 0x7fffffffu;
  if (magnitude > 0x7f800000u) return sign | 0x7e00u;   // NaN
  if (magnitude >= 0x477ff000u) return sign | 0x7c00u;  // rounds beyond 65504
  if (magnitude < 0x38800000u) {
    // Subnormal half: adding 0.5 puts the half's last place at the float's last place, and the
    // addition rounds to even.
    const float shifted = std::bit_cast<float>(magnitude) + 0.5f;
    return sign | static_cast<uint16_t>(std::bit_cast<uint32_t>(shifted) - 0x3f000000u);
  }
  const uint32_t odd = (magnitude >> 13) & 1u;
  return sign | static_cast<uint16_t>((magnitude - 0x38000000u + 0xfffu + odd) >> 13);
}

void ConvertToFloat(const char* bytes, ElementType type, uint64_t count, float* out) {
  switch (type) {
    case ElementType::kFloat32:
      std::memcpy(out, bytes, count * sizeof(float));
      return;
    case ElementType::kFloat16:
      return ConvertHalf(bytes, count, out);
    case ElementType::kBfloat16:
      return ConvertBfloat16(bytes, count, out);
    case ElementType::kFloat64:
      return ConvertPlain<double>(bytes, count, out);
    case ElementType::kInt8:
      return ConvertPlain<int8_t>(bytes, count, out);
    case ElementType::kUint8:
      return ConvertPlain<uint8_t>(bytes, count, out);
    case ElementType::kInt16:
      return ConvertPlain<int16_t>(bytes, count, out);
    case ElementType::kUint16:
      return ConvertPlain<uint16_t>(bytes, count, out);
    case ElementType::kInt32:
      return ConvertPlain<int32_t>(bytes, count, out);
    case ElementType::kUint32:
      return ConvertPlain<uint32_t>(bytes, count, out);
    case ElementType::kInt64:
      return ConvertPlain<int64_t>(bytes, count, out);
    case ElementType::kUint64:
      return ConvertPlain<uint64_t>(bytes, count, out);
    case ElementType::kBool:
      return ConvertBool(bytes, count, out);
  }
}

std::vector<float> ReadElements(const ByteSource& source,
                                uint64_t offset,
                                ElementType type,
                                uint64_t count) {
  const uint64_t size = static_cast<uint64_t>(ElementBytes(type));
  if (offset > source.size() || count > (source.size() - offset) / size) {
    throw source.Refusal("cut short: {} elements of {} bytes at {} do not fit its {} bytes",
                         count,
                         size,
                         offset,
                         source.size());
  }
  std::vector<float> values(count);
  if (type == ElementType::kFloat32) {
    source.ReadAt(offset, count * size, values.data());
    return values;
  }
  constexpr uint64_t kPieceElements = 1 << 16;
  std::string piece(std::min(count, kPieceElements) * size, '\0');
  for (uint64_t done = 0; done < count; done += kPieceElements) {
    const uint64_t now = std::min(kPieceElements, count - done);
    source.ReadAt(offset + done * size, now * size, piece.data());
    ConvertToFloat(piece.data(), type, now, values.data() + done);
  }
  return values;
}

int64_t CheckedElementCount(const ByteSource& source,
                            std::string_view name,
                            const std::vector<int64_t>& shape) {
  constexpr int64_t kMaxElements = int64_t{1} << 60;
  constexpr size_t kMaxRank = 16;
  if (shape.size() > kMaxRank) {
    throw source.Refusal(
        "{} has {} dimensions, at most 16 are read", QuotedName(name), shape.size());
  }
  int64_t count = 1;
  for (int64_t size : shape) {
    if (size < 0) {
      throw source.Refusal("{} has the negative size {}", QuotedName(name), size);
    }
    // The largest product so far is kept even when a later size is 0: [2^60, 2^60, 0] is no shape.
    if (size > 0 && count > kMaxElements / size) {
      throw source.Refusal("{} has more elements than can be counted", QuotedName(name));
    }
    count *= std::max<int64_t>(size, 1);
  }
  return std::find(shape.begin(), shape.end(), 0) == shape.end() ? count : 0;
}

}  // namespace color3d
