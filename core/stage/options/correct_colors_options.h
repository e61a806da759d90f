// Options of the stage correct_colors.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace color3d {

// Paint of the user on a photo in its present colours (sources/given_colors.h).
struct PaintedColors {
  enum class Kind { kStrokes, kPoints, kPicture };
  Kind kind = Kind::kPicture;
  std::filesystem::path file;
  std::filesystem::path labels;  // points: the picture that labels refer to
  bool operator==(const PaintedColors&) const = default;
};

struct ColorCorrection {
  std::string view;  // name or unique file stem
  PaintedColors colors;
  bool operator==(const ColorCorrection&) const = default;
};

// An additional key view that recolours the frames of its shot within a range of time.
struct RangeKeyView {
  std::string view;  // name or unique file stem
  // Seconds of the film, both ends included; nothing: from the beginning, to the end.
  std::optional<double> begin_s = {};
  std::optional<double> end_s = {};
  bool operator==(const RangeKeyView&) const = default;
};

struct CorrectColorsOptions {
  // Parts of photos in the colours that they should have, later ones over earlier ones, at most 64.
  // No held-out views.
  std::vector<ColorCorrection> corrections;
  // Films only, and without `corrections` (recolor/time_ranges.h). At most 64.
  std::vector<RangeKeyView> ranges;
  int proposals = 3;  // number of places that are named for further corrections, 0..16
  void Validate() const;
  bool operator==(const CorrectColorsOptions&) const = default;
};

}  // namespace color3d
