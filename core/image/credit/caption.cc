#include "core/image/credit/caption.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/base/text/utf8.h"
#include "core/image/draw.h"

namespace color3d {
namespace {

constexpr int kMinWidth = 100;     // px
constexpr int kMinLetter = 8;      // px, of a capital
constexpr double kLetter = 0.012;  // of a capital, as a share of the longer side
constexpr DrawColor kPaperWhite = {1.0f, 1.0f, 1.0f}, kInk = {0.12f, 0.12f, 0.12f};

// U+00C0 to U+017F (Latin-1 and Latin Extended-A) in ASCII, separated by spaces.
constexpr std::string_view kLatin =
    "A A A A Ae A AE C E E E E I I I I D N O O O O Oe x O U U U Ue Y Th ss "
    "a a a a ae a ae c e e e e i i i i d n o o o o oe / o u u u ue y th y "
    "A a A a A a C c C c C c C c D d D d E e E e E e E e E e G g G g G g G g H h H h "
    "I i I i I i I i I i IJ ij J j K k q L l L l L l L l L l N n N n N n n N n O o O o O o OE oe "
    "R r R r R r S s S s S s S s T t T t T t U u U u U u U u U u U u W w Y y Y Z z Z z Z z s";

const std::vector<std::string>& LatinTable() {
  static const std::vector<std::string> table = [] {
    std::vector<std::string> words(1);
    for (const char c : kLatin) {
      if (c == ' ') {
        words.emplace_back();
      } else {
        words.back() += c;
      }
    }
    return words;
  }();
  return table;
}

// The next character of valid UTF-8.
uint32_t NextCharacter(std::string_view text, size_t* at) {
  const auto byte = [&](size_t i) {
    return static_cast<uint32_t>(static_cast<unsigned char>(text[i]));
  };
  const uint32_t first = byte(*at);
  const size_t more = first < 0x80 ? 0 : first < 0xe0 ? 1 : first < 0xf0 ? 2 : 3;
  uint32_t character = more == 0 ? first : first & (0x3f >> more);
  for (size_t i = 1; i <= more; ++i) character = character << 6 | (byte(*at + i) & 0x3f);
  *at += more + 1;
  return character;
}

std::string AsciiOf(uint32_t character) {
  if (character < 0x80) return std::string(1, static_cast<char>(character));
  if (character >= 0xc0 && character < 0x180) return LatinTable()[character - 0xc0];
  switch (character) {
    case 0xa0:
      return " ";
    case 0xa9:
      return "(c)";
    case 0x2018:
    case 0x2019:
      return "'";
    case 0x201c:
    case 0x201d:
    case 0x201e:
      return "\"";
    case 0x2013:
    case 0x2014:
      return "-";
    default:
      return "";
  }
}

std::string Ascii(const std::string& text) {
  const std::string clean = CleanUtf8(text);
  std::string plain;
  for (size_t at = 0; at < clean.size();) {
    const size_t begin = at;
    const std::string letters = AsciiOf(NextCharacter(clean, &at));
    if (letters.empty()) {
      throw InvalidArgument(
          "the caption cannot show '{}'; write it in Latin letters, or leave the caption out: the "
          "data in the file keeps every script",
          clean.substr(begin, at - begin));
    }
    plain += letters;
  }
  return plain;
}

std::vector<std::string> BreakLines(const std::string& text, int height_px, int width_px) {
  std::vector<std::string> lines(1);
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find(' ', at), text.size());
    const std::string word = text.substr(at, end - at);
    const std::string longer = lines.back() + (lines.back().empty() ? "" : " ") + word;
    if (!lines.back().empty() && TextWidth(longer, height_px) > width_px) {
      lines.push_back(word);
    } else {
      lines.back() = longer;
    }
    at = end + 1;
  }
  for (std::string& line : lines) line = FittingText(line, height_px, width_px);
  return lines;
}

}  // namespace

Image WithCaption(const Image& picture, const std::string& text) {
  if (picture.width < kMinWidth) {
    throw InvalidArgument("a picture {} px wide is too small for a caption; {} px are needed",
                          picture.width,
                          kMinWidth);
  }
  const int longer = std::max(picture.width, picture.height);
  const int letter = std::max(kMinLetter, static_cast<int>(kLetter * longer));
  const int margin = letter, step = 2 * letter;
  const auto lines = BreakLines(Ascii(text), letter, picture.width - 2 * margin);
  const int strip = 2 * margin + step * static_cast<int>(lines.size()) - (step - letter);
  Image whole(picture.width, picture.height + strip, 3);
  DrawBox(0, 0, whole.width, whole.height, kPaperWhite, &whole);
  DrawPicture(picture, 0, 0, 1.0f, &whole);
  for (size_t i = 0; i < lines.size(); ++i) {
    DrawText(lines[i],
             margin,
             picture.height + margin + step * static_cast<int>(i),
             letter,
             kInk,
             &whole);
  }
  return whole;
}

}  // namespace color3d
