// The value of --add-key-view. Pure function of text and files, thread-safe.
#pragma once

#include <optional>
#include <string>

#include "client/options/key_color_flags.h"

namespace color3d::client {

// An additional key view: the photo's name and the source of its colour.
struct AdditionalKeyView {
  std::string view;
  KeyColorFlags color;
  // Films only: the range of time that it recolours, seconds; either end may be open.
  std::optional<double> begin_s = {};
  std::optional<double> end_s = {};
  bool HasRange() const { return begin_s || end_s; }
};
// Parses "VIEW=COLOURED.png", "VIEW=POINTS.json" or "VIEW=auto", optionally followed by
// "@BEGIN-END". Throws Error{kInvalidArgument} for other text, and the errors of checking the file.
AdditionalKeyView ParseAdditionalKeyView(const std::string& text);

}  // namespace color3d::client
