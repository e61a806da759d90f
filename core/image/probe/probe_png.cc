#include <zlib.h>

#include <algorithm>

#include "core/image/probe/probe_formats.h"

namespace color3d::probe_internal {
namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1A\n", 8);

uint32_t Crc32(std::string_view bytes) {
  return static_cast<uint32_t>(
      ::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

int ChannelsOfColorType(uint32_t type) {
  switch (type) {
    case 0:
      return 1;
    case 2:
      return 3;
    case 3:
      return 3;  // palette
    case 4:
      return 2;
    case 6:
      return 4;
    default:
      return 0;
  }
}

bool IsAllowedDepth(uint32_t type, uint32_t depth) {
  if (depth == 8) return true;
  if (depth == 16) return type != 3;
  return (depth == 1 || depth == 2 || depth == 4) && (type == 0 || type == 3);
}

void ReadHeader(const ProbeContext& context,
                const ByteReader& reader,
                size_t body,
                size_t length,
                ImageInfo* info) {
  if (length != 13) throw context.Damaged("its header chunk has a wrong length");
  const int64_t width = reader.U32(body);
  const int64_t height = reader.U32(body + 4);
  context.CheckSize(width, height);
  const uint32_t depth = reader.U8(body + 8);
  const uint32_t type = reader.U8(body + 9);
  info->width = static_cast<int>(width);
  info->height = static_cast<int>(height);
  info->bits_per_channel = static_cast<int>(depth);
  info->channels = ChannelsOfColorType(type);
  if (info->channels == 0 || !IsAllowedDepth(type, depth)) {
    throw context.Damaged("colour type {} with {} bits does not exist", type, depth);
  }
}

// Deflate shrinks at most 1032-fold: less data cannot hold the claimed image.
void CheckDataSize(const ProbeContext& context, const ImageInfo& info, int64_t data_bytes) {
  const int64_t pixels = static_cast<int64_t>(info.width) * info.height;
  const int64_t bits = pixels * info.bits_per_channel;  // of at least one channel
  if (data_bytes < bits / 8 / 1032) {
    throw context.Truncated("it holds {} bytes of data for {} px", data_bytes, pixels);
  }
}

}  // namespace

bool IsPng(std::string_view bytes) {
  // Four bytes suffice to recognize the intended format.
  const size_t n = std::min(bytes.size(), kSignature.size());
  return n >= 4 && bytes.substr(0, n) == kSignature.substr(0, n);
}

ImageInfo ProbePng(const ProbeContext& context) {
  const ByteReader reader(context.bytes);
  ImageInfo info;
  info.format = ImageFormat::kPng;
  size_t at = kSignature.size();
  int64_t data_bytes = 0;
  bool first = true;
  while (true) {
    if (!reader.Has(at, 12)) throw context.Truncated("it ends before its IEND chunk");
    const size_t length = reader.U32(at);
    const std::string_view type = reader.Slice(at + 4, 4);
    if (first != (type == "IHDR"))
      throw context.Damaged("its header chunk is not where it belongs");
    if (!reader.Has(at + 8, length) || !reader.Has(at + 8 + length, 4)) {
      throw context.Truncated("it ends inside a chunk");
    }
    if (Crc32(reader.Slice(at + 4, length + 4)) != reader.U32(at + 8 + length)) {
      throw context.Damaged("the checksum of a chunk at byte {} does not match", at);
    }
    if (first) ReadHeader(context, reader, at + 8, length, &info);
    first = false;
    if (type == "IDAT") data_bytes += static_cast<int64_t>(length);
    if (type == "IEND") break;
    at += 12 + length;
  }
  if (data_bytes == 0) throw context.Damaged("it holds no image data");
  CheckDataSize(context, info, data_bytes);
  return info;
}

}  // namespace color3d::probe_internal
