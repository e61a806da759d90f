#include "core/image/probe/exif.h"

#include <cstdint>

#include "core/image/probe/byte_reader.h"
#include "core/image/probe/probe_formats.h"

namespace color3d {
namespace {

std::string_view ExifOfJpeg(std::string_view bytes) {
  constexpr std::string_view kExif("Exif\0\0", 6);
  const ByteReader reader(bytes);
  size_t at = 2;
  while (reader.Has(at, 4) && reader.U8(at) == 0xFF) {
    const uint32_t marker = reader.U8(at + 1);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (marker == 0xDA || marker == 0xD9) return {};
    const size_t length = reader.U16(at + 2);
    if (length < 2) return {};
    const std::string_view body = reader.Slice(at + 4, length - 2);
    if (marker == 0xE1 && body.substr(0, kExif.size()) == kExif) return body.substr(kExif.size());
    at += 2 + length;
  }
  return {};
}

std::string_view ExifOfPng(std::string_view bytes) {
  const ByteReader reader(bytes);
  size_t at = 8;
  while (reader.Has(at, 12)) {
    const size_t length = reader.U32(at);
    const std::string_view type = reader.Slice(at + 4, 4);
    if (type == "eXIf") return reader.Slice(at + 8, length);
    if (type == "IEND" || !reader.Has(at + 8, length)) return {};
    at += 12 + length;
  }
  return {};
}

std::string_view ExifOfWebp(std::string_view bytes) {
  constexpr std::string_view kExif("Exif\0\0", 6);  // which some writers put before it
  const std::string_view block = probe_internal::FindWebpChunk(bytes, "EXIF");
  return block.starts_with(kExif) ? block.substr(kExif.size()) : block;
}

}  // namespace

std::string_view FindExifBlock(std::string_view bytes) {
  if (probe_internal::IsJpeg(bytes)) return ExifOfJpeg(bytes);
  if (probe_internal::IsPng(bytes)) return ExifOfPng(bytes);
  if (probe_internal::IsTiff(bytes)) return bytes;
  if (probe_internal::IsWebp(bytes)) return ExifOfWebp(bytes);
  if (probe_internal::IsHeif(bytes)) return probe_internal::FindHeifExif(bytes);
  return {};
}

bool FirstExifDirectory(std::string_view block, ExifDirectory* directory) {
  probe_internal::TiffHeader header;
  if (!probe_internal::ReadTiffHeader(block, &header)) return false;
  *directory = {block, header.first_directory, header.big_endian};
  return true;
}

bool FurtherExifDirectory(const ExifDirectory& from, unsigned tag, ExifDirectory* directory) {
  const size_t entry = FindExifEntry(from, tag);
  if (entry == 0) return false;
  *directory = from;
  directory->at = ByteReader(from.block, from.big_endian).U32(entry + 8);
  return true;
}

bool PhotoExifDirectory(const ExifDirectory& first, ExifDirectory* directory) {
  constexpr unsigned kPhotoDirectoryTag = 34665;
  return FurtherExifDirectory(first, kPhotoDirectoryTag, directory);
}

size_t FindExifEntry(const ExifDirectory& directory, unsigned tag) {
  const ByteReader reader(directory.block, directory.big_endian);
  const size_t count = reader.Has(directory.at, 2) ? reader.U16(directory.at) : 0;
  for (size_t i = 0; i < count; ++i) {
    const size_t entry = directory.at + 2 + 12 * i;
    if (!reader.Has(entry, 12)) return 0;
    if (reader.U16(entry) == tag) return entry;
  }
  return 0;
}

double ReadExifNumber(const ExifDirectory& directory, unsigned tag) {
  constexpr uint32_t kShort = 3, kLong = 4, kRational = 5;
  const size_t entry = FindExifEntry(directory, tag);
  if (entry == 0) return 0.0;
  const ByteReader reader(directory.block, directory.big_endian);
  switch (reader.U16(entry + 2)) {
    case kShort:
      return reader.U16(entry + 8);
    case kLong:
      return reader.U32(entry + 8);
    case kRational: {
      const size_t at = reader.U32(entry + 8);
      const double denominator = reader.U32(at + 4);
      return denominator > 0.0 ? reader.U32(at) / denominator : 0.0;
    }
    default:
      return 0.0;
  }
}

}  // namespace color3d
