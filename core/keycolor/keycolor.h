// Colouring the key view from what the user gives (METHOD.md "Stage 1b"). All pictures have the
// key photo's size as captured; L of the photo is always kept, only a and b are decided here.
#pragma once

#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/progress.h"
#include "core/color/lab.h"

namespace color3d {

// a, b of a coloured picture of the key view. `luminance`: 1 channel, L 0..100 of the key photo;
// `coloured`: 3 channels sRGB. Throws Error{kInvalidArgument} when sizes differ (both are named),
// when the picture has no colour, or when its luminance does not correlate with the key view's
// (it shows something else).
Image KeyColorFromImage(const Image& luminance, const Image& coloured);

struct ColorHint {
  double x_px = 0.0;  // centre of a disc, px from the upper left corner of the photo
  double y_px = 0.0;
  double radius_px = 2.0;
  double a = 0.0;  // Lab units
  double b = 0.0;
};

struct HintOptions {
  double sigma = 2.0;       // L difference (0..100) at which two neighbours stop to agree, > 0
  int max_side_px = 1024;   // solved at this size, upsampled guided by L; 64..8192
  double tolerance = 1e-6;  // relative residual of the conjugate gradients
  int max_iterations = 2000;
  void Validate() const;
};

struct HintSolution {
  Image ab;  // 2 channels, Lab units, size of `luminance`
  int iterations = 0;
  double relative_residual = 0.0;
  int hinted_pixels = 0;
};

// Strokes as a picture of the key photo's size: 4 channels (pixels with alpha > 0.5 are hints), or
// 3 channels (pixels whose chroma exceeds 6 Lab units are hints). Throws Error{kInvalidArgument}
// when no pixel is hinted or the size is another.
HintSolution KeyColorFromStrokes(const Image& luminance,
                                 const Image& strokes,
                                 const HintOptions& options,
                                 ProgressObserver& progress,
                                 const CancellationToken& cancel);
// JSON: [{"x": 120, "y": 80, "radius": 3, "color": "#a0522d"}, ...]. Throws Error{kInvalidArgument}
// naming the entry; hints outside the picture are an error.
std::vector<ColorHint> ParseHintsJson(const std::string& json);
HintSolution KeyColorFromHints(const Image& luminance,
                               const std::vector<ColorHint>& hints,
                               const HintOptions& options,
                               ProgressObserver& progress,
                               const CancellationToken& cancel);

}  // namespace color3d
