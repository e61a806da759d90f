// Number formats of weight files and their conversion to float32. Pure functions. For this
// folder only.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/bytes/byte_source.h"

namespace color3d {

enum class ElementType {
  kFloat32,
  kFloat16,
  kBfloat16,
  kFloat64,
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kBool,
};

int ElementBytes(ElementType type);

// Little-endian elements to float32 (the nearest value; integers above 2^24 are rounded).
void ConvertToFloat(const char* bytes, ElementType type, uint64_t count, float* out);

// `count` elements at `offset` of the source, read in pieces to avoid a second copy of a
// large array. Throws Error{kInvalidArgument} before any allocation if they are not inside the
// source.
std::vector<float> ReadElements(const ByteSource& source,
                                uint64_t offset,
                                ElementType type,
                                uint64_t count);

// Returns the nearest IEEE half, ties to even; infinity beyond 65504.
uint16_t HalfFromFloat(float value);
float FloatFromHalf(uint16_t half);

// Returns the product of the sizes. Throws source.Refusal() if a size is negative or the product
// exceeds 2^60.
int64_t CheckedElementCount(const ByteSource& source,
                            std::string_view name,
                            const std::vector<int64_t>& shape);

}  // namespace color3d
