#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "core/image/probe/probe_formats.h"

namespace color3d::probe_internal {
namespace {

constexpr size_t kFileHeaderBytes = 14;
constexpr uint32_t kOs2HeaderBytes = 12;
constexpr uint32_t kHeaderBytes[] = {kOs2HeaderBytes, 40, 52, 56, 64, 108, 124};
// Compression, as in BITMAPINFOHEADER.
constexpr uint32_t kRgb = 0, kRle8 = 1, kRle4 = 2, kBitFields = 3, kAlphaBitFields = 6;

bool IsHeaderSize(uint32_t bytes) {
  return std::find(std::begin(kHeaderBytes), std::end(kHeaderBytes), bytes) !=
         std::end(kHeaderBytes);
}

void CheckKind(const ProbeContext& context, uint32_t bits, uint32_t compression) {
  const bool plain = compression == kRgb && (bits == 1 || bits == 4 || bits == 8 || bits == 16 ||
                                             bits == 24 || bits == 32);
  const bool fields = compression == kBitFields && (bits == 16 || bits == 32);
  const bool runs = (compression == kRle8 && bits == 8) || (compression == kRle4 && bits == 4);
  if (plain || fields || runs) return;
  if (compression <= kAlphaBitFields) {
    throw InvalidArgument(
        "{} is a BMP of an unsupported kind ({} bits, compression {}); save it as PNG",
        context.file_name,
        bits,
        compression);
  }
  throw context.Damaged("it claims {} bits a pixel and compression {}", bits, compression);
}

// Missing colours are black.
bool HasGrayPalette(const ByteReader& reader, uint32_t header, uint32_t bits) {
  const size_t entry_bytes = header == kOs2HeaderBytes ? 3 : 4;
  const uint32_t used = header == kOs2HeaderBytes ? 0 : reader.U32(kFileHeaderBytes + 32);
  const uint32_t count = used == 0 ? 1u << bits : std::min(used, 1u << bits);
  for (uint32_t i = 0; i < count; ++i) {
    const size_t at = kFileHeaderBytes + header + i * entry_bytes;
    if (reader.U8(at) != reader.U8(at + 1) || reader.U8(at) != reader.U8(at + 2)) return false;
  }
  return true;
}

}  // namespace

// Many texts begin with "BM", too: all available header fields must be plausible.
bool IsBmp(std::string_view bytes) {
  if (bytes.size() < 6 || bytes.substr(0, 2) != "BM") return false;
  const ByteReader reader(bytes, /*big_endian=*/false);
  if (reader.U32(6) != 0) return false;
  return !reader.Has(kFileHeaderBytes, 4) || IsHeaderSize(reader.U32(kFileHeaderBytes));
}

ImageInfo ProbeBmp(const ProbeContext& context) {
  const ByteReader reader(context.bytes, /*big_endian=*/false);
  const uint32_t header = reader.U32(kFileHeaderBytes);
  if (!reader.Has(kFileHeaderBytes, std::max(header, kOs2HeaderBytes))) {
    throw context.Truncated("it ends inside its header");
  }
  const bool os2 = header == kOs2HeaderBytes;
  const size_t at = kFileHeaderBytes + 4;
  const auto number = [&](size_t i) -> int64_t {
    return os2 ? reader.U16(at + 2 * i) : int64_t{static_cast<int32_t>(reader.U32(at + 4 * i))};
  };
  const int64_t width = number(0);
  const int64_t height = std::abs(number(1));  // rows from top to bottom count below zero
  context.CheckSize(width, height);
  const uint32_t bits = reader.U16(at + (os2 ? 6 : 10));
  const uint32_t compression = os2 ? kRgb : reader.U32(at + 12);
  CheckKind(context, bits, compression);
  const size_t data = reader.U32(10);
  if (data < kFileHeaderBytes + header) throw context.Damaged("its data begins in its header");
  const uint64_t row_bytes = (static_cast<uint64_t>(width) * bits + 31) / 32 * 4;
  const bool runs = compression == kRle8 || compression == kRle4;
  // A run of two bytes is 255 pixels at most; rows may be skipped, but hardly all of them.
  const uint64_t least = runs ? 2 : row_bytes * static_cast<uint64_t>(height);
  if (!reader.Has(data, least)) {
    throw context.Truncated("it ends inside its image data");
  }
  ImageInfo info;
  info.format = ImageFormat::kBmp;
  info.width = static_cast<int>(width);
  info.height = static_cast<int>(height);
  info.channels = bits == 32 && compression == kBitFields             ? 4
                  : bits <= 8 && HasGrayPalette(reader, header, bits) ? 1
                                                                      : 3;
  return info;
}

}  // namespace color3d::probe_internal
