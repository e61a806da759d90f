// JSON and plain text as other programs write them: with a byte order mark, NaN, Infinity and
// trailing commas. Pure functions, thread-safe.
#pragma once

#include <cstddef>
#include <iterator>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace color3d {

// `text` without the UTF-8 byte order mark that editors put before it. Throws
// Error{kInvalidArgument} that names the file for UTF-16, which such a mark tells.
std::string_view WithoutMark(std::string_view text, const std::string& file_name);

// The characters of a JSON text, one after the other, without what JSON forbids and other programs
// write: a comma before a closing bracket is left out; NaN, Infinity and numbers beyond a double
// become strings, which readers of numbers refuse by name and everybody else passes over. Line
// numbers stay. An input iterator; memory does not grow with the text, which must outlive it.
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
  // At a character that was not there yet: skips commas, finds where tokens end.
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

// What a JSON library says of an error, without its own number for it; in one line.
std::string JsonErrorText(const std::string& what);

}  // namespace color3d
