// Options of the stage colorize_key_view: the source of a key view's colours.
#pragma once

#include <filesystem>
#include <optional>
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
  std::filesystem::path file;  // image, strokes, points (JSON), edit; backend: points, may be empty
  std::vector<std::filesystem::path> references;  // references: 1..16; backend: at most 1
  std::filesystem::path mask;                     // edit and backend; empty: everywhere
  std::filesystem::path labels;                   // points: the picture that labels refer to
  std::string prompt;                             // prompt; backend, may be empty
  std::string name;  // weights, script or backend by name; empty: the embedded model
  HintOptions hints;
  bool operator==(const ColorizeKeyViewOptions&) const = default;
};

// A key view beside the first one. Of its colours only those are taken that the key views before it
// have not given already; so they never contradict. In a film it colours the frames of its shot
// that are nearer to it and what is open in others, and has what is not painted from the key views
// before it.
struct FurtherKeyView {
  std::string view;  // name or unique file stem
  ColorizeKeyViewOptions color;
  // Of a correction of a film: the frames of its shot that it counts in, seconds of the film, both
  // ends included; nothing: from the beginning, to the end.
  std::optional<double> begin_s = {};
  std::optional<double> end_s = {};
  bool HasRange() const { return begin_s || end_s; }
  bool operator==(const FurtherKeyView&) const = default;
};

}  // namespace color3d
