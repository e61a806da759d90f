#include "client/options/additional_key_view.h"

#include <charconv>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "core/base/error.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

// Parses "10-14.5", "10-" or "-14.5". Returns false for other text.
bool ParseRange(std::string_view text, AdditionalKeyView* key) {
  const auto seconds = [](std::string_view number, std::optional<double>* to) {
    if (number.empty()) return true;
    double value = 0.0;
    const auto [end, error] = std::from_chars(
        number.data(), number.data() + number.size(), value, std::chars_format::fixed);
    *to = value;
    return error == std::errc() && end == number.data() + number.size();
  };
  const size_t dash = text.find('-');
  return dash != std::string_view::npos && seconds(text.substr(0, dash), &key->begin_s) &&
         seconds(text.substr(dash + 1), &key->end_s) && key->HasRange();
}

// Moves a range of time at the end of `value`, if there is one, to `key`. A file may be called
// "a@2x.png".
void ExtractRange(std::string* value, AdditionalKeyView* key) {
  const size_t at = value->rfind('@');
  if (at == std::string::npos) return;
  const std::string range = value->substr(at + 1);
  if (range.find_first_not_of("0123456789.-") != std::string::npos) return;
  if (!ParseRange(range, key)) {
    throw InvalidArgument(
        "--add-key-view {}: '{}' is not a range of time; write seconds of the film, BEGIN-END, "
        "e.g. "
        "@10-14.5, or @10- for up to its end",
        key->view,
        "@" + range);
  }
  if (key->begin_s && key->end_s && *key->end_s < *key->begin_s) {
    throw InvalidArgument(
        "--add-key-view {}: the range of time ends at {} s, before it begins at {} s",
        key->view,
        *key->end_s,
        *key->begin_s);
  }
  value->resize(at);
}

}  // namespace

AdditionalKeyView ParseAdditionalKeyView(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw InvalidArgument(
        "--add-key-view '{}' is not of the form VIEW=COLOURED.png, the name of a photo and its "
        "coloured picture; VIEW=POINTS.json and VIEW=auto are possible, too, and for films "
        "VIEW=COLOURED.png@BEGIN-END, in seconds",
        text);
  }
  std::string value = text.substr(equals + 1);
  AdditionalKeyView key{text.substr(0, equals), {}};
  ExtractRange(&value, &key);
  if (value == "auto") {
    key.color.automatic = true;
  } else if (fs::path(value).extension() == ".json") {
    key.color.hints = value;
  } else {
    key.color.image = value;
  }
  try {
    key.color.Check();
  } catch (const Error& e) {
    throw Error(e.code(), "--add-key-view {}: {}", key.view, e.what());
  }
  return key;
}

}  // namespace color3d::client
