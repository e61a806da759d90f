#include <algorithm>

#include "core/image/probe/probe_formats.h"

namespace color3d::probe_internal {
namespace {

constexpr size_t kFileHeaderBytes = 12;  // RIFF, size, WEBP
constexpr uint32_t kAnimationFlag = 0x02, kAlphaFlag = 0x10;

Error Animated(const ProbeContext& context) {
  return InvalidArgument("{} is an animated WebP; save its pictures one by one, as PNG",
                         context.file_name);
}

uint32_t U24(const ByteReader& reader, size_t at) {
  return reader.U16(at) | reader.U8(at + 2) << 16;
}

struct Size {
  int64_t width = 0;
  int64_t height = 0;
};

// A key frame's header (RFC 6386, 9.1).
Size LossySize(const ProbeContext& context, const ByteReader& reader, size_t body, size_t length) {
  if (length < 10) throw context.Damaged("its image data is too short");
  if (reader.Slice(body + 3, 3) != "\x9D\x01\x2A" || (reader.U8(body) & 1u) != 0) {
    throw context.Damaged("its image data does not begin with a key frame");
  }
  return {reader.U16(body + 6) & 0x3FFFu, reader.U16(body + 8) & 0x3FFFu};
}

// A lossless picture's header: 14 bits each of width - 1 and height - 1, and one of alpha.
Size LosslessSize(const ProbeContext& context,
                  const ByteReader& reader,
                  size_t body,
                  size_t length,
                  bool* has_alpha) {
  if (length < 5) throw context.Damaged("its image data is too short");
  if (reader.U8(body) != 0x2F) throw context.Damaged("its image data does not begin as such");
  const uint32_t bits = reader.U32(body + 1);
  *has_alpha = *has_alpha || (bits >> 28 & 1u) != 0;
  return {(bits & 0x3FFFu) + 1, (bits >> 14 & 0x3FFFu) + 1};
}

}  // namespace

bool IsWebp(std::string_view bytes) {
  const std::string_view kind = bytes.substr(std::min<size_t>(bytes.size(), 8), 4);
  return bytes.starts_with("RIFF") && !kind.empty() && std::string_view("WEBP").starts_with(kind);
}

std::string_view FindWebpChunk(std::string_view bytes, std::string_view type) {
  const ByteReader reader(bytes, /*big_endian=*/false);
  size_t at = kFileHeaderBytes;
  while (reader.Has(at, 8)) {
    const size_t length = reader.U32(at + 4);
    if (reader.Slice(at, 4) == type) return reader.Slice(at + 8, length);
    if (!reader.Has(at + 8, length)) return {};
    at += 8 + length + length % 2;
  }
  return {};
}

ImageInfo ProbeWebp(const ProbeContext& context) {
  const ByteReader reader(context.bytes, /*big_endian=*/false);
  if (!reader.Has(0, kFileHeaderBytes)) throw context.Truncated("it ends inside its header");
  const size_t end = size_t{8} + reader.U32(4);
  if (!reader.Has(0, end)) {
    throw context.Truncated("it has {} bytes of {}", reader.size(), end);
  }
  Size canvas, picture;
  bool has_alpha = false;
  size_t at = kFileHeaderBytes;
  while (at + 8 <= end && picture.width == 0) {
    const std::string_view type = reader.Slice(at, 4);
    const size_t body = at + 8, length = reader.U32(at + 4);
    if (body + length > end) throw context.Damaged("a chunk is longer than the file");
    if (type == "VP8X") {
      if (length < 10) throw context.Damaged("its header is too short");
      const uint32_t flags = reader.U8(body);
      if ((flags & kAnimationFlag) != 0) throw Animated(context);
      has_alpha = (flags & kAlphaFlag) != 0;
      canvas = {int64_t{1} + U24(reader, body + 4), int64_t{1} + U24(reader, body + 7)};
    } else if (type == "VP8 ") {
      picture = LossySize(context, reader, body, length);
    } else if (type == "VP8L") {
      picture = LosslessSize(context, reader, body, length, &has_alpha);
    } else if (type == "ANIM" || type == "ANMF") {
      throw Animated(context);
    }
    at = body + length + length % 2;
  }
  if (picture.width == 0 && canvas.width == 0) throw context.Damaged("it holds no image data");
  const Size size = picture.width == 0 ? canvas : picture;
  context.CheckSize(size.width, size.height);
  if (picture.width == 0) throw context.Damaged("it holds no image data");
  if (canvas.width != 0 && (canvas.width != size.width || canvas.height != size.height)) {
    throw context.Damaged("its header and its data differ in size");
  }
  ImageInfo info;
  info.format = ImageFormat::kWebp;
  info.width = static_cast<int>(size.width);
  info.height = static_cast<int>(size.height);
  info.channels = has_alpha ? 4 : 3;
  return info;
}

}  // namespace color3d::probe_internal
