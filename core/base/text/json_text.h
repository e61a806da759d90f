// JSON and plain text as written by other programs: with a byte order mark, NaN, Infinity and
// trailing commas. Pure functions, thread-safe.
#pragma once

#include <cstddef>
#include <iterator>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace color3d {

// Returns `text` without a leading UTF-8 byte order mark. Throws Error{kInvalidArgument} with the
// file's name if the mark is that of UTF-16.
std::string_view WithoutMark(std::string_view text, const std::string& file_name);

// Iterates over the characters of a JSON text and repairs common violations of the standard: omits
// commas before a closing bracket; turns NaN, Infinity and numbers beyond double into strings,
// which number parsers reject by name and other readers ignore. Line numbers are preserved. An
// input iterator; memory does not grow with the text, which must outlive it.
class PlainJson {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = char;

  PlainJson() = default;  // the end of every text
  explicit PlainJson(std::string_view text);

  char operator*() const;
  PlainJson& operator++();
  bool operator==(const PlainJson& other) const;
  bool operator!=(const PlainJson& other) const { return !(*this == other); }

 private:
  enum class Quoted { kNot, kOpening, kToken };
  bool AtEnd() const { return at_ >= text_.size() && quoted_ == Quoted::kNot; }
  // Called at each new character: skips commas, finds ends of tokens.
  void Arrive();

  std::string_view text_;
  size_t at_ = 0;
  size_t token_end_ = 0;  // of the number or word at `at_`, or before it
  bool in_string_ = false;
  bool escaped_ = false;
  Quoted quoted_ = Quoted::kNot;
};

// Throws Error{kInvalidArgument}: "NAME is not JSON: parse error at line 3, column 7: ...".
nlohmann::json ParseJson(std::string_view text, const std::string& file_name);

// The message of a JSON library's error without the library's error number, in one line.
std::string JsonErrorText(const std::string& what);

}  // namespace color3d
