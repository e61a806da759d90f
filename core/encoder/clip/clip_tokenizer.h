// CLIP's byte-level byte-pair encoder (Sennrich et al. 2016; Radford et al. 2021): maps text to
// token numbers. No torch. Immutable, thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace color3d {

class ClipTokenizer {
 public:
  // `merges`: the text of the published vocabulary, one header line and then one merge "left right"
  // per line, best first (bpe_simple_vocab_16e6.txt, or merges.txt as other hubs call it).
  // `vocabulary_size` is the number of rows of the token embedding (49408 in all published models):
  // 2 * 256 bytes, the merges, start and end of text. Throws Error{kInvalidArgument} naming
  // `source` if the text has fewer merges, or a line that is not a merge.
  ClipTokenizer(std::string_view merges, int vocabulary_size, const std::string& source);
  // Reads the vocabulary from a file, plain or gzip.
  static ClipTokenizer FromFile(const std::filesystem::path& path, int vocabulary_size);

  // Returns start of text, the tokens, end of text, and zeros up to `context` numbers. Excess
  // tokens before the end of text are dropped. Text is lower-cased, NFC, with straight quotes (as
  // by the authors' clean-up of ordinary text); invalid UTF-8 becomes U+FFFD. Control tokens in the
  // text are plain text. Throws Error{kInvalidArgument} for more than 2000 bytes.
  std::vector<int64_t> Tokens(const std::string& text, int context = 77) const;

  int64_t start_of_text() const { return start_of_text_; }
  int64_t end_of_text() const { return start_of_text_ + 1; }

 private:
  void AppendWord(std::string_view bytes, std::vector<int64_t>& tokens) const;

  std::vector<std::string> symbol_of_byte_;            // UTF-8 of the printable symbol of each byte
  std::unordered_map<std::string, int> rank_of_pair_;  // key "left right"
  std::unordered_map<std::string, int64_t> token_of_symbol_;
  int64_t start_of_text_ = 0;
};

}  // namespace color3d
