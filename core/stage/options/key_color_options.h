// Options of the stage colorize_key_view: the source of a key view's colours.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/keycolor/hints/hints.h"

namespace color3d {

struct ColorizeKeyViewOptions {
  enum class Source {
    kImage,
    kStrokes,
    kPoints,
    kReferences,
    kPrompt,
    kAutomatic,
    kBackend,
    kScript,
    kEdit
  };
  Source source = Source::kImage;
  std::filesystem::path file;  // image, strokes, points (JSON) or edit; backend: points or empty
  std::vector<std::filesystem::path> references;  // references: 1..16; backend: at most 1
  std::filesystem::path mask;                     // edit and backend; empty: everywhere
  std::filesystem::path labels;                   // points, above: what labels refer to
  std::filesystem::path above;  // points (JSON) above the colours of the source; empty: none
  std::string prompt;           // prompt; backend, may be empty
  std::string name;             // weights, script or backend by name; empty: the embedded model
  HintOptions hints;
  std::string view;  // additional key view: name or unique file stem; empty: the chosen key view
  bool operator==(const ColorizeKeyViewOptions&) const = default;
};

}  // namespace color3d
