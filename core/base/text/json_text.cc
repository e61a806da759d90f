#include "core/base/text/json_text.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/text/lower_case.h"

namespace color3d {
namespace {

constexpr std::string_view kMark = "\xef\xbb\xbf";
constexpr std::string_view kJsonBlanks = " \t\r\n";

bool IsTokenCharacter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '+' || c == '.';
}

// A word for a number that JSON lacks.
bool IsNonJsonNumber(std::string_view token) {
  if (token.front() == '-' || token.front() == '+') token.remove_prefix(1);
  const std::string word = LowerCase(token.substr(0, 16));
  if (word == "nan" || word == "inf" || word == "infinity") return true;
  if (word.empty() || std::isdigit(static_cast<unsigned char>(word[0])) == 0) return false;
  double value = 0.0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  // Too small numbers are out of range, too, and are equivalent to 0.
  return error == std::errc::result_out_of_range && end == token.data() + token.size() &&
         token.find("e-") == token.npos && token.find("E-") == token.npos;
}

}  // namespace

std::string_view WithoutMark(std::string_view text, const std::string& file_name) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    throw InvalidArgument("{} is UTF-16 text; save it as UTF-8", file_name);
  }
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  return text;
}

PlainJson::PlainJson(std::string_view text) : text_(text) {
  if (text_.starts_with(kMark)) text_.remove_prefix(kMark.size());
  Arrive();
}

char PlainJson::operator*() const {
  return quoted_ == Quoted::kOpening                      ? '"'
         : at_ == token_end_ && quoted_ == Quoted::kToken ? '"'
                                                          : text_[at_];
}

PlainJson& PlainJson::operator++() {
  if (quoted_ == Quoted::kOpening) {
    quoted_ = Quoted::kToken;
    return *this;
  }
  if (quoted_ == Quoted::kToken) {
    if (at_ < token_end_) {
      ++at_;
      return *this;
    }
    quoted_ = Quoted::kNot;  // the closing quote was read; what follows is not read yet
    Arrive();
    return *this;
  }
  const char c = text_[at_++];
  if (in_string_) {
    in_string_ = escaped_ || c != '"';
    escaped_ = !escaped_ && c == '\\';
  } else if (c == '"') {
    in_string_ = true;
  }
  Arrive();
  return *this;
}

void PlainJson::Arrive() {
  if (in_string_ || at_ < token_end_) return;
  while (at_ < text_.size() && text_[at_] == ',') {
    const size_t next = text_.find_first_not_of(kJsonBlanks, at_ + 1);
    if (next == text_.npos || (text_[next] != ']' && text_[next] != '}')) return;
    ++at_;
  }
  if (at_ >= text_.size() || !IsTokenCharacter(text_[at_])) return;
  token_end_ = at_;
  while (token_end_ < text_.size() && IsTokenCharacter(text_[token_end_])) ++token_end_;
  if (IsNonJsonNumber(text_.substr(at_, token_end_ - at_))) quoted_ = Quoted::kOpening;
}

bool PlainJson::operator==(const PlainJson& other) const {
  if (AtEnd() || other.AtEnd()) return AtEnd() == other.AtEnd();
  return at_ == other.at_ && quoted_ == other.quoted_ && text_.data() == other.text_.data();
}

nlohmann::json ParseJson(std::string_view text, const std::string& file_name) {
  try {
    return nlohmann::json::parse(PlainJson(WithoutMark(text, file_name)), PlainJson());
  } catch (const nlohmann::json::exception& e) {
    throw InvalidArgument("{} is not JSON: {}", file_name, JsonErrorText(e.what()));
  }
}

std::string JsonErrorText(const std::string& what) {
  const size_t end = what.starts_with('[') ? what.find("] ") : what.npos;
  std::string text = (end == what.npos ? what : what.substr(end + 2)).substr(0, 300);
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  return text;
}

}  // namespace color3d
