#include "core/image/credit/picture_credit.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/base/error.h"
#include "core/base/text/utf8.h"
#include "core/image/credit/credit_xmp.h"

namespace color3d {
namespace {

using Texts = std::vector<std::pair<std::string, std::string>>;

constexpr size_t kMaxTextBytes = 500;
constexpr char kInferred[] = "Colours are inferred.";
constexpr std::string_view kPngSignature("\x89PNG\r\n\x1A\n", 8);
constexpr char kXmpKeyword[] = "XML:com.adobe.xmp";
constexpr std::array<std::string_view, 6> kPngKeywords = {
    "Description", "Copyright", "Source", "Software", "Disclaimer", kXmpKeyword};
constexpr std::string_view kXmpMark("http://ns.adobe.com/xap/1.0/\0", 29);
constexpr std::string_view kPhotoshopMark("Photoshop 3.0\0", 14);
constexpr std::string_view kIptcBlock("8BIM\x04\x04\0\0", 8);  // resource 0x0404 without a name
constexpr size_t kMaxSegmentBytes = 65533;                     // of JPEG, without its length

Error Damaged(const std::string& name) {
  return InvalidArgument("{} is damaged; it gets no credit", name);
}

uint32_t ReadBig(std::string_view bytes, size_t at, size_t count) {
  uint32_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

std::string Big(size_t value, int count) {
  std::string bytes;
  for (int i = count - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
  return bytes;
}

struct PngChunk {
  std::string_view type, body, whole;
};

std::vector<PngChunk> ChunksOf(std::string_view png, const std::string& name) {
  std::vector<PngChunk> chunks;
  for (size_t at = kPngSignature.size(); at < png.size();) {
    if (png.size() - at < 12) throw Damaged(name);
    const size_t length = ReadBig(png, at, 4);
    if (png.size() - at - 12 < length) throw Damaged(name);
    chunks.push_back(
        {png.substr(at + 4, 4), png.substr(at + 8, length), png.substr(at, length + 12)});
    if (chunks.back().type == "IEND") return chunks;
    at += length + 12;
  }
  throw Damaged(name);
}

// Keyword and text of an uncompressed iTXt; an empty keyword for others.
std::pair<std::string, std::string> ParseText(std::string_view body) {
  const size_t end = body.find('\0');
  if (end == body.npos || body.size() < end + 3 || body[end + 1] != 0) return {};
  const size_t language = body.find('\0', end + 3);
  if (language == body.npos) return {};
  const size_t translated = body.find('\0', language + 1);
  if (translated == body.npos) return {};
  return {std::string(body.substr(0, end)), std::string(body.substr(translated + 1))};
}

std::string TextChunk(const std::string& keyword, const std::string& text) {
  // Not compressed, no language, no translated keyword.
  const std::string typed = "iTXt" + keyword + std::string(5, '\0') + text;
  const uLong crc = ::crc32_z(
      0, reinterpret_cast<const Bytef*>(typed.data()), static_cast<z_size_t>(typed.size()));
  return Big(typed.size() - 4, 4) + typed + Big(crc, 4);
}

std::string AddToPng(std::string_view png, const PictureCredit& credit, const std::string& name) {
  std::string texts;
  const auto add = [&](const char* keyword, const std::string& text) {
    if (!text.empty()) texts += TextChunk(keyword, text);
  };
  add("Description", CreditText(credit));
  add("Copyright", credit.licence);
  add("Source", credit.source);
  add("Software", credit.software);
  add("Disclaimer", kInferred);
  add(kXmpKeyword, XmpOf(credit));
  std::string result(kPngSignature);
  for (const PngChunk& chunk : ChunksOf(png, name)) {
    const bool is_earlier =
        chunk.type == "iTXt" &&
        std::ranges::find(kPngKeywords, std::string_view(ParseText(chunk.body).first)) !=
            kPngKeywords.end();
    if (!is_earlier) result += chunk.whole;
    if (chunk.type == "IHDR") result += texts;
  }
  return result;
}

struct JpegSegment {
  int marker = 0;  // 0xE1 and so on
  std::string_view body, whole;
};

// Segments before the pixels; `rest` begins with them.
std::vector<JpegSegment> SegmentsOf(std::string_view jpeg,
                                    const std::string& name,
                                    std::string_view* rest) {
  std::vector<JpegSegment> segments;
  for (size_t at = 2;;) {
    if (jpeg.size() - at < 4 || static_cast<unsigned char>(jpeg[at]) != 0xff) throw Damaged(name);
    const int marker = static_cast<unsigned char>(jpeg[at + 1]);
    const size_t length = ReadBig(jpeg, at + 2, 2);
    if (length < 2 || jpeg.size() - at - 2 < length) throw Damaged(name);
    if (marker == 0xda) {
      *rest = jpeg.substr(at);
      return segments;
    }
    segments.push_back({marker, jpeg.substr(at + 4, length - 2), jpeg.substr(at, length + 2)});
    at += length + 2;
  }
}

std::string Segment(int marker, const std::string& body) {
  return std::string("\xff") + static_cast<char>(marker) + Big(body.size() + 2, 2) + body;
}

bool IsXmp(const JpegSegment& segment) {
  return segment.marker == 0xe1 && segment.body.starts_with(kXmpMark);
}

bool IsIptc(const JpegSegment& segment) {
  return segment.marker == 0xed && segment.body.starts_with(kPhotoshopMark);
}

// IIM 4.2: `max_bytes` are those of the standard.
std::string DataSet(int record, int number, const std::string& text, size_t max_bytes) {
  if (text.empty()) return "";
  const std::string kept = CleanUtf8(text, max_bytes);
  return std::string("\x1c") + static_cast<char>(record) + static_cast<char>(number) +
         Big(kept.size(), 2) + kept;
}

std::string IptcOf(const PictureCredit& credit) {
  const std::string sets = std::string("\x1c\x01\x5a\0\x03\x1b%G", 8) +  // UTF-8
                           std::string("\x1c\x02\0\0\x02\0\x04", 7) +    // version 4
                           DataSet(2, 40, kInferred, 256) + DataSet(2, 65, credit.software, 32) +
                           DataSet(2, 115, credit.source, 32) +
                           DataSet(2, 116, credit.licence, 128) +
                           DataSet(2, 120, CreditText(credit), 2000);
  std::string block = std::string(kPhotoshopMark) + std::string(kIptcBlock) + Big(sets.size(), 4);
  block += sets;
  if (sets.size() % 2 == 1) block += '\0';
  return block;
}

std::string AddToJpeg(std::string_view jpeg, const PictureCredit& credit, const std::string& name) {
  std::string_view rest;
  const std::vector<JpegSegment> segments = SegmentsOf(jpeg, name, &rest);
  const std::string xmp = std::string(kXmpMark) + XmpOf(credit);
  if (xmp.size() > kMaxSegmentBytes) throw InvalidArgument("the credit is too long; shorten it");
  const std::string texts = Segment(0xe1, xmp) + Segment(0xed, IptcOf(credit));
  std::string result(jpeg.substr(0, 2));
  bool is_added = false;
  for (const JpegSegment& segment : segments) {
    // JFIF and Exif come first.
    const bool is_first = segment.marker == 0xe0 || (segment.marker == 0xe1 && !IsXmp(segment));
    if (!is_first && !is_added) result += texts;
    is_added = is_added || !is_first;
    if (!IsXmp(segment) && !IsIptc(segment)) result += segment.whole;
  }
  if (!is_added) result += texts;
  return result + std::string(rest);
}

bool IsPngFile(std::string_view bytes) { return bytes.starts_with(kPngSignature); }
bool IsJpegFile(std::string_view bytes) { return bytes.starts_with("\xff\xd8\xff"); }

Error Unsupported(const std::string& name) {
  return InvalidArgument("{} is neither PNG nor JPEG; a credit is written into these", name);
}

void ReadIptc(std::string_view body, Texts* texts) {
  const size_t block = body.find(kIptcBlock);
  if (block == body.npos || body.size() < block + kIptcBlock.size() + 4) return;
  const size_t begin = block + kIptcBlock.size() + 4;
  const size_t end = std::min(body.size(), begin + ReadBig(body, begin - 4, 4));
  for (size_t at = begin; at + 5 <= end && body[at] == '\x1c';) {
    const size_t length = ReadBig(body, at + 3, 2);
    if (at + 5 + length > end) return;
    texts->emplace_back(
        std::to_string(ReadBig(body, at + 1, 1)) + ":" + std::to_string(ReadBig(body, at + 2, 1)),
        std::string(body.substr(at + 5, length)));
    at += 5 + length;
  }
}

}  // namespace

bool PictureCredit::IsEmpty() const {
  return colored_by.empty() && key_view_by.empty() && source.empty() && licence.empty();
}

void PictureCredit::Validate() const {
  for (const std::string* text : {&colored_by, &key_view_by, &source, &licence, &software}) {
    if (text->size() > kMaxTextBytes) {
      throw InvalidArgument("'{}...' is too long for a credit; {} bytes are possible",
                            CleanUtf8(*text, 40),
                            kMaxTextBytes);
    }
    if (EscapeControls(*text) != *text) {
      throw InvalidArgument("'{}' cannot be a credit: it has control characters, or is not UTF-8",
                            EscapeControls(CleanUtf8(*text, 80)));
    }
  }
}

std::string CreditText(const PictureCredit& credit) {
  std::string text;
  const auto add = [&](const char* before, const std::string& what) {
    if (what.empty()) return;
    text += before + what + (what.ends_with('.') ? " " : ". ");
  };
  add("Coloured by ", credit.colored_by);
  add("Key view by ", credit.key_view_by);
  add("Original: ", credit.source);
  add("Licence: ", credit.licence);
  return text + kInferred;
}

std::string AddCredit(std::string_view picture,
                      const PictureCredit& credit,
                      const std::string& name) {
  credit.Validate();
  if (IsPngFile(picture)) return AddToPng(picture, credit, name);
  if (IsJpegFile(picture)) return AddToJpeg(picture, credit, name);
  throw Unsupported(name);
}

Texts ReadPictureTexts(std::string_view picture, const std::string& name) {
  Texts texts;
  if (IsPngFile(picture)) {
    for (const PngChunk& chunk : ChunksOf(picture, name)) {
      if (chunk.type != "iTXt") continue;
      auto [keyword, text] = ParseText(chunk.body);
      if (keyword.empty()) continue;
      texts.emplace_back(keyword == kXmpKeyword ? "XMP" : keyword, std::move(text));
    }
    return texts;
  }
  if (!IsJpegFile(picture)) throw Unsupported(name);
  std::string_view rest;
  for (const JpegSegment& segment : SegmentsOf(picture, name, &rest)) {
    if (IsXmp(segment)) texts.emplace_back("XMP", segment.body.substr(kXmpMark.size()));
    if (IsIptc(segment)) ReadIptc(segment.body, &texts);
  }
  return texts;
}

}  // namespace color3d
