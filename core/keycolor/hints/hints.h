// Colours of the key view from hints (STILL.md "Stage 1b"): strokes, points, lines and regions,
// propagated along the luminance. All pictures have the size of the key photo as captured. The
// result does not depend on the number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"

namespace color3d {

class QuickGrid;
inline constexpr double kMinReach = 0.1, kMaxReach = 2.0;

// Pixels of given colour: a disc, a line, a polygon, or a label of a label picture.
struct ColorHint {
  double x_px = 0.0;  // centre of a disc, px from the upper left corner of the photo
  double y_px = 0.0;
  double radius_px = 2.0;  // radius of a disc, half the width of a line
  double a = 0.0;          // Lab units
  double b = 0.0;

  enum class Shape { kDisc, kLine, kRegion, kLabel };
  // kNeutral: no colour (a = b = 0). kAutomatic: colours of the automatic colourizer.
  enum class Fill { kColor, kNeutral, kAutomatic };
  Shape shape = Shape::kDisc;
  Fill fill = Fill::kColor;
  std::vector<std::array<double, 2>> points_px = {};  // (x, y) of a line or region
  int label = 0;                                      // 0..255
  // Corrections of a scene only (STILL.md "Corrections"): how far the colour goes to similar
  // places, kMinReach..kMaxReach, 1: as measured.
  double reach = 1.0;
};

struct HintOptions {
  double sigma = 0.5;       // L difference (0..100) that halves the coupling of neighbours, 0.1..50
  int max_side_px = 8192;   // larger photos are solved at this size and upsampled, guided by L
  double tolerance = 5e-4;  // relative residual of the conjugate gradients
  int max_iterations = 200;
  void Validate() const;
  bool operator==(const HintOptions&) const = default;
};

struct HintSolution {
  Image ab;  // 2 channels, Lab units, size of `luminance`; hinted pixels hold their hint exactly
  int iterations = 0;
  double relative_residual = 0.0;  // residual of the system without the hinted pixels
  int64_t hinted_pixels = 0;
};

// Pictures of the key photo's size that hints may refer to.
struct HintPictures {
  const Image* labels = nullptr;        // 1 channel, value * 255 is the label
  const Image* automatic_ab = nullptr;  // 2 channels, for Fill::kAutomatic
  // The hints were made for a larger picture (ScaleHints): those that are too small for a pixel get
  // one.
  bool is_reduced = false;
};

// Strokes as a picture of the key photo's size: 4 channels (pixels with alpha > 0.5 are hints), or
// 3 channels (pixels whose chroma exceeds 6 Lab units are hints). Throws Error{kInvalidArgument} if
// no pixel is hinted or the size differs.
HintSolution KeyColorFromStrokes(const Image& luminance,
                                 const Image& strokes,
                                 const HintOptions& options,
                                 const RunControl& control);

// Parses a JSON list of entries, each one of
//   {"x": 120, "y": 80, "radius": 3, "color": "#a0522d"}     a disc; radius 2 by default
//   {"line": [[10, 20], [80, 25]], "width": 4, "color": "#a0522d"}   width 4 by default
//   {"region": [[10, 20], [80, 25], [40, 90]], "color": "#a0522d"}   a polygon (even-odd)
//   {"label": 3, "color": "#a0522d"}                         all pixels of that label
// in px of the key photo. Instead of "color", "keep": "neutral" removes the colour, and
// "keep": "auto" keeps that of the automatic colourizer. Each may have a "reach". Throws
// Error{kInvalidArgument} naming the entry.
std::vector<ColorHint> ParseHintsJson(const std::string& json);

// The hints for a copy of the picture whose sides are these shares of the picture's, above 0.
std::vector<ColorHint> ScaleHints(std::vector<ColorHint> hints, double x, double y);

// Propagates the hints. Throws an error naming a hint that lies outside the picture or covers no
// pixel. Where hints overlap, the last one wins; warns if they contradict each other.
// `prepared`: of the same picture and sigma, see PrepareHints; null: none.
HintSolution KeyColorFromHints(const Image& luminance,
                               const std::vector<ColorHint>& hints,
                               const HintOptions& options,
                               const RunControl& control,
                               const HintPictures& pictures = {},
                               QuickGrid* prepared = nullptr);

// What KeyColorFromHints needs of the picture alone, for quick answers while hints are added: near
// the colours (quick_grid.h), whatever the tolerance. The pool must outlive it. Requires: sides of
// at most options.max_side_px.
std::shared_ptr<QuickGrid> PrepareHints(const Image& luminance,
                                        const HintOptions& options,
                                        ThreadPool& pool);

int64_t BytesOf(const QuickGrid& prepared);

}  // namespace color3d
