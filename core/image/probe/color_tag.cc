#include "core/image/probe/color_tag.h"

#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "core/image/probe/byte_reader.h"
#include "core/image/probe/exif.h"
#include "core/image/probe/probe_formats.h"
#include "core/image/probe/tiff_pages.h"

namespace color3d {
namespace {

constexpr size_t kMaxProfileBytes = size_t{4} << 20;

void SetProfile(std::string_view profile, ColorTag* tag) {
  if (profile.size() > kMaxProfileBytes) {
    tag->problem = fmt::format("its colour profile has {} bytes", profile.size());
  } else {
    tag->profile = profile;
  }
}

// Its parts are numbered from 1 on (ICC.1, B.4).
ColorTag TagOfJpeg(std::string_view bytes) {
  constexpr std::string_view kMark("ICC_PROFILE\0", 12);
  const ByteReader reader(bytes);
  std::map<uint32_t, std::string_view> parts;
  uint32_t count = 0;
  size_t at = 2;
  while (reader.Has(at, 4) && reader.U8(at) == 0xFF) {
    const uint32_t marker = reader.U8(at + 1);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    const size_t length = reader.U16(at + 2);
    if (marker == 0xDA || marker == 0xD9 || length < 2) break;
    const std::string_view body = reader.Slice(at + 4, length - 2);
    if (marker == 0xE2 && body.starts_with(kMark) && body.size() > kMark.size() + 2) {
      const ByteReader part(body);
      if (parts.empty()) count = part.U8(kMark.size() + 1);
      parts.emplace(part.U8(kMark.size()), body.substr(kMark.size() + 2));
    }
    at += 2 + length;
  }
  ColorTag tag;
  std::string profile;
  for (uint32_t i = 1; i <= count; ++i) {
    if (!parts.contains(i)) {
      tag.problem = fmt::format("part {} of {} of its colour profile is missing", i, count);
      return tag;
    }
    profile += parts[i];
  }
  SetProfile(profile, &tag);
  return tag;
}

// Name, NUL, method 0, deflated profile.
void InflateProfile(std::string_view body, ColorTag* tag) {
  const size_t end = body.find('\0');
  if (end == std::string_view::npos || body.size() < end + 3 || body[end + 1] != 0) {
    tag->problem = "its colour profile is damaged";
    return;
  }
  const std::string_view packed = body.substr(end + 2);
  std::string profile;
  z_stream stream{};
  if (::inflateInit(&stream) != Z_OK) return;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  int state = Z_OK;
  while (state == Z_OK && profile.size() <= kMaxProfileBytes) {
    char block[16384];
    stream.next_out = reinterpret_cast<Bytef*>(block);
    stream.avail_out = sizeof(block);
    state = ::inflate(&stream, Z_NO_FLUSH);
    profile.append(block, sizeof(block) - stream.avail_out);
  }
  ::inflateEnd(&stream);
  if (state != Z_STREAM_END && profile.size() <= kMaxProfileBytes) {
    tag->problem = "its colour profile is damaged";
    return;
  }
  SetProfile(profile, tag);
}

bool IsSrgb(const Chromaticities& c) {
  const double differences[] = {c.white_x - 0.3127,
                                c.white_y - 0.3290,
                                c.red_x - 0.64,
                                c.red_y - 0.33,
                                c.green_x - 0.30,
                                c.green_y - 0.60,
                                c.blue_x - 0.15,
                                c.blue_y - 0.06};
  return std::all_of(std::begin(differences), std::end(differences), [](double difference) {
    return std::abs(difference) < 0.005;
  });
}

// Ignores chunks that a more specific chunk overrides (PNG, 11.3.2).
ColorTag TagOfPng(std::string_view bytes) {
  const ByteReader reader(bytes);
  ColorTag tag, weak;
  bool is_srgb = false;
  size_t at = 8;
  while (reader.Has(at, 12)) {
    const size_t length = reader.U32(at), body = at + 8;
    const std::string_view type = reader.Slice(at + 4, 4);
    if (type == "IDAT" || type == "IEND" || !reader.Has(body, length)) break;
    const auto number = [&](size_t i) { return reader.U32(body + 4 * i) / 100'000.0; };
    if (type == "iCCP") InflateProfile(reader.Slice(body, length), &tag);
    if (type == "sRGB") is_srgb = true;
    if (type == "gAMA" && length == 4 && number(0) > 0.0) weak.gamma = 1.0 / number(0);
    if (type == "cHRM" && length == 32) {
      weak.primaries = Chromaticities{
          number(0), number(1), number(2), number(3), number(4), number(5), number(6), number(7)};
    }
    at = body + length + 4;
  }
  tag.is_srgb = is_srgb;
  if (is_srgb || !tag.profile.empty() || !tag.problem.empty()) return tag;
  // Primaries without a curve are unusable. Programs that mean sRGB write a gamma of 1 / 2.2.
  if (weak.gamma == 0.0) return {};
  if (!(weak.gamma >= 0.2 && weak.gamma <= 5.0)) {
    return {.problem = fmt::format("its gamma is {:g}", weak.gamma)};
  }
  if (std::abs(weak.gamma - 2.2) < 0.01 && (!weak.primaries || IsSrgb(*weak.primaries))) {
    return {.is_srgb = true};
  }
  return weak;
}

ColorTag TagOfTiff(std::string_view bytes) {
  constexpr unsigned kProfile = 34675;
  ColorTag tag;
  ExifDirectory directory;
  if (!FirstExifDirectory(bytes, &directory)) return tag;
  directory.at = ChosenTiffDirectory(bytes);
  const size_t entry = FindExifEntry(directory, kProfile);
  if (entry == 0) return tag;
  const ByteReader reader(bytes, directory.big_endian);
  const size_t length = reader.U32(entry + 4), at = reader.U32(entry + 8);
  if (length <= 4 || !reader.Has(at, length)) {
    tag.problem = "its colour profile is damaged";
    return tag;
  }
  SetProfile(reader.Slice(at, length), &tag);
  return tag;
}

// BITMAPV5HEADER, whose bV5CSType gives the location of the profile.
ColorTag TagOfBmp(std::string_view bytes) {
  constexpr size_t kHeader = 14, kVersion5Bytes = 124;
  ColorTag tag;
  const ByteReader reader(bytes, /*big_endian=*/false);
  if (reader.U32(kHeader) < kVersion5Bytes || !reader.Has(kHeader, kVersion5Bytes)) return tag;
  const std::string_view kind = reader.Slice(kHeader + 56, 4);
  if (kind == "KNIL") tag.problem = "its colour profile is in another file";
  if (kind != "DEBM") return tag;
  const size_t at = kHeader + reader.U32(kHeader + 112), length = reader.U32(kHeader + 116);
  if (!reader.Has(at, length)) {
    tag.problem = "its colour profile is damaged";
  } else {
    SetProfile(reader.Slice(at, length), &tag);
  }
  return tag;
}

// Design rule for Camera File system: photos of the option file "R03" are Adobe RGB.
ColorTag TagOfExif(std::string_view bytes) {
  constexpr unsigned kInteroperability = 40965, kIndex = 1;
  constexpr double kAdobeGamma = 563.0 / 256.0;
  ColorTag tag;
  ExifDirectory first, photo, interoperability;
  if (!FirstExifDirectory(FindExifBlock(bytes), &first)) return tag;
  if (!PhotoExifDirectory(first, &photo)) return tag;
  if (!FurtherExifDirectory(photo, kInteroperability, &interoperability)) return tag;
  const size_t entry = FindExifEntry(interoperability, kIndex);
  if (entry == 0 || first.block.substr(entry + 8, 3) != "R03") return tag;
  tag.gamma = kAdobeGamma;
  tag.primaries = Chromaticities{0.3127, 0.3290, 0.64, 0.33, 0.21, 0.71, 0.15, 0.06};
  return tag;
}

ColorTag TagOfFormat(std::string_view bytes) {
  using namespace probe_internal;
  if (IsJpeg(bytes)) return TagOfJpeg(bytes);
  if (IsPng(bytes)) return TagOfPng(bytes);
  if (IsTiff(bytes)) return TagOfTiff(bytes);
  if (IsBmp(bytes)) return TagOfBmp(bytes);
  ColorTag tag;
  if (IsWebp(bytes)) SetProfile(FindWebpChunk(bytes, "ICCP"), &tag);
  if (IsHeif(bytes)) SetProfile(FindHeifProfile(bytes), &tag);
  return tag;
}

}  // namespace

ColorTag ReadColorTag(std::string_view bytes) {
  ColorTag tag = TagOfFormat(bytes);
  const bool is_silent =
      !tag.is_srgb && tag.profile.empty() && tag.gamma == 0.0 && tag.problem.empty();
  return is_silent ? TagOfExif(bytes) : tag;
}

}  // namespace color3d
