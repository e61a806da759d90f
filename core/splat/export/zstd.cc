#include "core/splat/export/zstd.h"

#include <zstd.h>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kLevel = 12;

}  // namespace

std::string Zstd(std::string_view plain) {
  std::string packed(ZSTD_compressBound(plain.size()), '\0');
  const size_t size =
      ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kLevel);
  if (ZSTD_isError(size) != 0) {
    throw Error(ErrorCode::kResourceExhausted, "zstd: {}", ZSTD_getErrorName(size));
  }
  packed.resize(size);
  return packed;
}

}  // namespace color3d
