#include "core/encoder/clip/clip_tokenizer.h"

#include <unicode/locid.h>
#include <unicode/normalizer2.h>
#include <unicode/uchar.h>
#include <unicode/unistr.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kBytes = 256;
constexpr int kControlTokens = 2;
constexpr size_t kMaxTextBytes = 2000;           // merging is quadratic in the length of a word
constexpr size_t kMaxVocabularyBytes = 1 << 24;  // published: 3.1 MB
constexpr const char* kEndOfWord = "</w>";

std::string Utf8(UChar32 code_point) {
  std::string bytes;
  icu::UnicodeString(code_point).toUTF8String(bytes);
  return bytes;
}

// Printable symbols of all bytes, in the order of the vocabulary: bytes that are printable in
// Latin-1 represent themselves, the others follow as U+0100, U+0101, ...
struct ByteSymbols {
  std::vector<std::string> by_byte{kBytes};
  std::vector<std::string> in_order;
};

ByteSymbols MakeByteSymbols() {
  const auto printable = [](int byte) {
    return (byte >= 33 && byte <= 126) || (byte >= 161 && byte <= 172) || byte >= 174;
  };
  ByteSymbols symbols;
  for (int byte = 0; byte < kBytes; ++byte) {
    if (!printable(byte)) continue;
    symbols.by_byte[byte] = Utf8(byte);
    symbols.in_order.push_back(symbols.by_byte[byte]);
  }
  UChar32 next = 0x100;
  for (int byte = 0; byte < kBytes; ++byte) {
    if (printable(byte)) continue;
    symbols.by_byte[byte] = Utf8(next++);
    symbols.in_order.push_back(symbols.by_byte[byte]);
  }
  return symbols;
}

std::string_view NextLine(std::string_view& text) {
  const size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

// NFC, straight quotes, lower case.
icu::UnicodeString Clean(const std::string& text) {
  icu::UnicodeString clean = icu::UnicodeString::fromUTF8(text);
  UErrorCode status = U_ZERO_ERROR;
  const icu::Normalizer2* nfc = icu::Normalizer2::getNFCInstance(status);
  if (U_SUCCESS(status)) {
    const icu::UnicodeString normal = nfc->normalize(clean, status);
    if (U_SUCCESS(status)) clean = normal;
  }
  for (const auto& [curly, straight] : {std::pair{0x2018, '\''},
                                        std::pair{0x2019, '\''},
                                        std::pair{0x201c, '"'},
                                        std::pair{0x201d, '"'}}) {
    clean.findAndReplace(icu::UnicodeString(static_cast<UChar32>(curly)),
                         icu::UnicodeString(static_cast<UChar32>(straight)));
  }
  return clean.toLower(icu::Locale::getRoot());
}

bool IsLetter(UChar32 c) { return (U_GET_GC_MASK(c) & U_GC_L_MASK) != 0; }
bool IsNumber(UChar32 c) { return (U_GET_GC_MASK(c) & U_GC_N_MASK) != 0; }

// Returns the length of the word at `begin`: the tail of a contraction, a run of letters, one
// digit, or a run of other characters but white space. 0 at white space.
int WordLength(const icu::UnicodeString& text, int begin) {
  for (const char* tail : {"'s", "'t", "'re", "'ve", "'m", "'ll", "'d"}) {
    const icu::UnicodeString pattern(tail);
    if (text.compare(begin, pattern.length(), pattern) == 0) return pattern.length();
  }
  const UChar32 first = text.char32At(begin);
  if (u_isUWhiteSpace(first)) return 0;
  if (IsNumber(first)) return U16_LENGTH(first);
  const bool letters = IsLetter(first);
  int end = begin;
  while (end < text.length()) {
    const UChar32 c = text.char32At(end);
    const bool fits = letters ? IsLetter(c) : !u_isUWhiteSpace(c) && !IsLetter(c) && !IsNumber(c);
    if (!fits) break;
    end += U16_LENGTH(c);
  }
  return end - begin;
}

}  // namespace

ClipTokenizer::ClipTokenizer(std::string_view merges,
                             int vocabulary_size,
                             const std::string& source) {
  const int merge_count = vocabulary_size - 2 * kBytes - kControlTokens;
  if (merge_count < 0) {
    throw InvalidArgument(
        "the CLIP weights have {} tokens, fewer than the {} of a byte-pair vocabulary",
        vocabulary_size,
        2 * kBytes + kControlTokens);
  }
  ByteSymbols symbols = MakeByteSymbols();
  symbol_of_byte_ = std::move(symbols.by_byte);
  for (int i = 0; i < kBytes; ++i) {
    token_of_symbol_[symbols.in_order[i]] = i;
    token_of_symbol_[symbols.in_order[i] + kEndOfWord] = kBytes + i;
  }
  NextLine(merges);  // the header
  for (int i = 0; i < merge_count; ++i) {
    const std::string line(NextLine(merges));
    const size_t space = line.find(' ');
    const bool is_merge = space != std::string::npos && space > 0 && space + 1 < line.size() &&
                          line.find(' ', space + 1) == std::string::npos;
    if (!is_merge) {
      throw InvalidArgument(
          "{}: line {} is not a merge; the weights' vocabulary needs {} lines of two symbols after "
          "the header",
          source,
          i + 2,
          merge_count);
    }
    rank_of_pair_.emplace(line, i);
    token_of_symbol_[line.substr(0, space) + line.substr(space + 1)] = 2 * kBytes + i;
  }
  start_of_text_ = 2 * kBytes + merge_count;
}

ClipTokenizer ClipTokenizer::FromFile(const std::filesystem::path& path, int vocabulary_size) {
  // gzread reads plain files, too.
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  if (!file) throw Error(ErrorCode::kNotFound, "cannot open the vocabulary {}", path.string());
  std::string text;
  std::vector<char> buffer(1 << 16);
  int count = 0;
  while ((count = gzread(file.get(), buffer.data(), static_cast<unsigned>(buffer.size()))) > 0) {
    text.append(buffer.data(), static_cast<size_t>(count));
    if (text.size() > kMaxVocabularyBytes) {
      throw InvalidArgument("{} unpacks to more than 16 MB and is not a vocabulary", path.string());
    }
  }
  if (count < 0) throw Error(ErrorCode::kDataLoss, "{} is damaged (gzip)", path.string());
  return ClipTokenizer(text, vocabulary_size, path.string());
}

void ClipTokenizer::AppendWord(std::string_view bytes, std::vector<int64_t>& tokens) const {
  std::vector<std::string> word;
  for (const char byte : bytes) word.push_back(symbol_of_byte_[static_cast<unsigned char>(byte)]);
  word.back() += kEndOfWord;
  while (word.size() > 1) {
    int best = std::numeric_limits<int>::max();
    size_t best_at = 0;
    for (size_t i = 0; i + 1 < word.size(); ++i) {
      const auto found = rank_of_pair_.find(word[i] + " " + word[i + 1]);
      if (found == rank_of_pair_.end() || found->second >= best) continue;
      best = found->second;
      best_at = i;
    }
    if (best == std::numeric_limits<int>::max()) break;
    const std::string left = word[best_at];
    const std::string right = word[best_at + 1];
    std::vector<std::string> merged;
    for (size_t i = 0; i < word.size(); ++i) {
      const bool pair = i + 1 < word.size() && word[i] == left && word[i + 1] == right;
      merged.push_back(pair ? left + right : word[i]);
      if (pair) ++i;
    }
    word = std::move(merged);
  }
  for (const std::string& symbol : word) tokens.push_back(token_of_symbol_.at(symbol));
}

std::vector<int64_t> ClipTokenizer::Tokens(const std::string& text, int context) const {
  if (text.size() > kMaxTextBytes) {
    throw InvalidArgument("the text has {} bytes; shorten it to at most 2000", text.size());
  }
  const icu::UnicodeString clean = Clean(text);
  std::vector<int64_t> tokens{start_of_text_};
  for (int begin = 0; begin < clean.length();) {
    const int length = WordLength(clean, begin);
    if (length == 0) {
      begin += U16_LENGTH(clean.char32At(begin));
      continue;
    }
    std::string bytes;
    clean.tempSubString(begin, length).toUTF8String(bytes);
    AppendWord(bytes, tokens);
    begin += length;
  }
  tokens.resize(std::min<size_t>(tokens.size(), context - 1));
  tokens.push_back(end_of_text());
  tokens.resize(context, 0);
  return tokens;
}

}  // namespace color3d
