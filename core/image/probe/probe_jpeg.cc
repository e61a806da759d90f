#include "core/image/probe/probe_formats.h"

namespace color3d::probe_internal {
namespace {

constexpr uint32_t kEndOfImage = 0xD9;
constexpr uint32_t kStartOfScan = 0xDA;

bool IsFrameHeader(uint32_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}
// Markers that stand alone, without a length: TEM and RST0..RST7.
bool StandsAlone(uint32_t marker) { return marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7); }

// SOFn: length, precision, height, width, number of components (ITU-T T.81, B.2.2).
void ReadFrameHeader(const ProbeContext& context,
                     const ByteReader& reader,
                     size_t body,
                     size_t length,
                     uint32_t marker,
                     ImageInfo* info) {
  if (length < 8) throw context.Damaged("its frame header is too short");
  const uint32_t precision = reader.U8(body);
  info->height = static_cast<int>(reader.U16(body + 1));
  info->width = static_cast<int>(reader.U16(body + 3));
  info->channels = static_cast<int>(reader.U8(body + 5));
  info->bits_per_channel = static_cast<int>(precision);
  context.CheckSize(info->width, info->height);
  const bool lossless_or_hierarchical =
      (marker & 3u) == 3u || (marker >= 0xC5 && marker <= 0xC7) || marker >= 0xCD;
  if (lossless_or_hierarchical || precision != 8) {
    throw InvalidArgument(
        "{} is a lossless, hierarchical or more than 8-bit JPEG, which cannot be read; save it as "
        "PNG or TIFF",
        context.file_name);
  }
  if (info->channels == 4) throw context.InCmyk();
  if (info->channels != 1 && info->channels != 3) {
    throw context.Damaged("it claims {} colour components", info->channels);
  }
}

}  // namespace

// Requires another marker at once: OpenCV does not recognize other files as JPEG and would try its
// readers of other formats (DICOM, all of GDAL's).
bool IsJpeg(std::string_view bytes) {
  return bytes.substr(0, 3) == "\xFF\xD8\xFF" || bytes == "\xFF\xD8";
}

ImageInfo ProbeJpeg(const ProbeContext& context) {
  const ByteReader reader(context.bytes);
  ImageInfo info;
  info.format = ImageFormat::kJpeg;
  bool has_frame = false;
  bool has_scan = false;
  size_t at = 2;
  while (true) {
    // Entropy-coded data (after a scan header) runs up to the next real marker: FF 00 is a stuffed
    // byte, FF D0..D7 a restart, and FF FF padding. Bytes between segments before
    // the first scan are invalid but skipped, as decoders do.
    at = context.bytes.find('\xFF', at);
    if (at == std::string_view::npos || !reader.Has(at, 2)) {
      throw context.Truncated("it ends before its end-of-image marker");
    }
    const uint32_t marker = reader.U8(at + 1);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    at += 2;
    if (marker == 0x00 || StandsAlone(marker)) continue;
    if (marker == kEndOfImage) break;  // trailing bytes are ignored
    if (marker == 0xD8) throw context.Damaged("a second image starts inside it");
    if (!reader.Has(at, 2)) throw context.Truncated("it ends inside its header");
    const size_t length = reader.U16(at);
    if (length < 2) throw context.Damaged("a segment has no length");
    if (!reader.Has(at, length)) throw context.Truncated("it ends inside its header");
    if (IsFrameHeader(marker)) {
      if (has_frame) throw context.Damaged("it has two frame headers");
      ReadFrameHeader(context, reader, at + 2, length, marker, &info);
      has_frame = true;
    }
    if (marker == kStartOfScan) {
      if (!has_frame) throw context.Damaged("image data comes before its size");
      has_scan = true;
    }
    at += length;
  }
  if (!has_frame || !has_scan) throw context.Damaged("it holds no image data");
  return info;
}

}  // namespace color3d::probe_internal
