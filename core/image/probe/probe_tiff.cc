#include <algorithm>
#include <map>

#include "core/image/probe/probe_formats.h"
#include "core/image/probe/tiff_pages.h"

namespace color3d::probe_internal {
namespace {

// TIFF 6.0 tags.
constexpr uint32_t kWidth = 256;
constexpr uint32_t kHeight = 257;
constexpr uint32_t kBitsPerSample = 258;
constexpr uint32_t kCompression = 259;
constexpr uint32_t kPhotometric = 262;
constexpr uint32_t kStripOffsets = 273;
constexpr uint32_t kSamplesPerPixel = 277;
constexpr uint32_t kStripByteCounts = 279;
constexpr uint32_t kTileOffsets = 324;
constexpr uint32_t kTileByteCounts = 325;
constexpr uint32_t kSampleFormat = 339;

// Location of the values of one directory entry, inside the file.
struct Entry {
  uint32_t type = 0;
  uint32_t count = 0;
  size_t offset = 0;
};
using Directory = std::map<uint32_t, Entry>;

size_t BytesOfType(uint32_t type) {
  constexpr size_t kBytes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
  return type < 13 ? kBytes[type] : 0;
}

Directory ReadDirectory(const ProbeContext& context, const ByteReader& reader, size_t at) {
  if (!reader.Has(at, 2)) throw context.Truncated("its directory lies behind its end");
  const size_t count = reader.U16(at);
  if (!reader.Has(at + 2, 12 * count)) throw context.Truncated("it ends inside its directory");
  Directory directory;
  for (size_t i = 0; i < count; ++i) {
    const size_t entry_at = at + 2 + 12 * i;
    Entry entry{reader.U16(entry_at + 2), reader.U32(entry_at + 4), entry_at + 8};
    const uint64_t bytes = uint64_t{entry.count} * BytesOfType(entry.type);
    if (bytes > 4) {
      entry.offset = reader.U32(entry_at + 8);
      if (bytes > reader.size() || !reader.Has(entry.offset, bytes)) {
        throw context.Truncated("tag {} points behind its end", reader.U16(entry_at));
      }
    }
    directory.emplace(reader.U16(entry_at), entry);
  }
  return directory;
}

// Value `index` of a tag of type BYTE, SHORT or LONG.
uint32_t Value(const ByteReader& reader, const Entry& entry, size_t index) {
  if (index >= entry.count) return 0;
  switch (entry.type) {
    case 1:
      return reader.U8(entry.offset + index);
    case 3:
      return reader.U16(entry.offset + 2 * index);
    case 4:
      return reader.U32(entry.offset + 4 * index);
    default:
      return 0;
  }
}

uint32_t ValueOr(const ByteReader& reader,
                 const Directory& directory,
                 uint32_t tag,
                 uint32_t absent) {
  const auto it = directory.find(tag);
  return it == directory.end() || it->second.count == 0 ? absent : Value(reader, it->second, 0);
}

// Sum of the bytes in all strips or tiles, each of which must lie inside the file.
uint64_t CheckPieces(const ProbeContext& context,
                     const ByteReader& reader,
                     const Directory& directory,
                     uint32_t offsets_tag,
                     uint32_t counts_tag) {
  const auto offsets = directory.find(offsets_tag);
  const auto counts = directory.find(counts_tag);
  if (offsets == directory.end() || counts == directory.end() || offsets->second.count == 0 ||
      offsets->second.count != counts->second.count) {
    throw context.Damaged("it does not say where its image data lies");
  }
  uint64_t total = 0;
  for (size_t i = 0; i < offsets->second.count; ++i) {
    const uint32_t bytes = Value(reader, counts->second, i);
    if (!reader.Has(Value(reader, offsets->second, i), bytes)) {
      throw context.Truncated("strip {} of its image data lies behind its end", i);
    }
    total += bytes;
  }
  return total;
}

void CheckSamples(const ProbeContext& context, const ImageInfo& info, uint32_t sample_format) {
  const int bits = info.bits_per_channel;
  const bool integer = sample_format == 1 || sample_format == 4;
  if (!integer || (bits != 1 && bits != 2 && bits != 4 && bits != 8 && bits != 16)) {
    throw InvalidArgument("{} has {}{} samples; save it as 8- or 16-bit unsigned TIFF or PNG",
                          context.file_name,
                          bits,
                          integer ? "-bit" : "-bit signed or floating-point");
  }
  if (info.channels < 1 || info.channels > 4) {
    throw context.Damaged("it claims {} channels", info.channels);
  }
}

void CheckColors(const ProbeContext& context, uint32_t photometric) {
  constexpr uint32_t kSeparated = 5, kColorFilterArray = 32803, kLinearRaw = 34892;
  if (photometric == kSeparated) throw context.InCmyk();
  if (photometric == kColorFilterArray || photometric == kLinearRaw) {
    throw InvalidArgument(
        "{} holds a camera's raw data; develop it (darktable, RawTherapee) into a 16-bit TIFF",
        context.file_name);
  }
}

}  // namespace

bool ReadTiffHeader(std::string_view bytes, TiffHeader* header) {
  if (bytes.size() < 8) return false;
  const std::string_view mark = bytes.substr(0, 4);
  if (mark == std::string_view("II*\0", 4)) {
    header->big_endian = false;
  } else if (mark == std::string_view("MM\0*", 4)) {
    header->big_endian = true;
  } else {
    return false;
  }
  header->first_directory = ByteReader(bytes, header->big_endian).U32(4);
  return true;
}

bool IsTiff(std::string_view bytes) {
  const std::string_view mark = bytes.substr(0, 4);
  return mark == std::string_view("II*\0", 4) || mark == std::string_view("MM\0*", 4) ||
         mark == std::string_view("II+\0", 4) || mark == std::string_view("MM\0+", 4);
}

ImageInfo ProbeTiff(const ProbeContext& context) {
  if (context.bytes[2] == '+' || context.bytes[3] == '+') {
    throw InvalidArgument("{} is a BigTIFF, which cannot be read; save it as TIFF or PNG",
                          context.file_name);
  }
  TiffHeader header;
  if (!ReadTiffHeader(context.bytes, &header)) throw context.Truncated("it ends inside its header");
  const ByteReader reader(context.bytes, header.big_endian);
  ImageInfo info;
  info.format = ImageFormat::kTiff;
  info.tiff_directory = ChosenTiffDirectory(context.bytes);
  const Directory directory = ReadDirectory(context, reader, info.tiff_directory);
  const uint32_t width = ValueOr(reader, directory, kWidth, 0);
  const uint32_t height = ValueOr(reader, directory, kHeight, 0);
  context.CheckSize(width, height);
  info.width = static_cast<int>(width);
  info.height = static_cast<int>(height);
  info.bits_per_channel = static_cast<int>(ValueOr(reader, directory, kBitsPerSample, 1));
  const uint32_t samples = ValueOr(reader, directory, kSamplesPerPixel, 1);
  const uint32_t photometric = ValueOr(reader, directory, kPhotometric, 1);
  CheckColors(context, photometric);
  info.channels = photometric == 3 ? 3 : static_cast<int>(std::min(samples, 1000u));
  info.min_is_white = photometric == 0 && samples == 1;
  CheckSamples(context, info, ValueOr(reader, directory, kSampleFormat, 1));

  const bool tiled = directory.count(kTileOffsets) > 0;
  const uint64_t data_bytes = CheckPieces(context,
                                          reader,
                                          directory,
                                          tiled ? kTileOffsets : kStripOffsets,
                                          tiled ? kTileByteCounts : kStripByteCounts);
  const uint64_t raw_bytes = uint64_t{width} * height * samples * info.bits_per_channel / 8;
  const bool compressed = ValueOr(reader, directory, kCompression, 1) != 1;
  // No TIFF compression in use shrinks more than deflate (1032) does by more than a few times.
  if (data_bytes < (compressed ? raw_bytes / 5000 : raw_bytes)) {
    throw context.Truncated("it holds {} bytes of data for {} x {} px", data_bytes, width, height);
  }
  return info;
}

}  // namespace color3d::probe_internal
