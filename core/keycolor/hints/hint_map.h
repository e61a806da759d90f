// Rasterizes hints onto the pixels of a photo. Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/image.h"
#include "core/base/progress.h"
#include "core/keycolor/hints/hints.h"

namespace color3d {

struct HintMap {
  std::vector<uint8_t> hinted;     // 1 where the colour is given
  Image ab;                        // 2 channels; valid where hinted
  std::vector<uint8_t> kept = {};  // 1 where hinted by Fill::kAutomatic; empty: nowhere
  bool IsKept(size_t i) const { return !kept.empty() && kept[i] != 0; }
};

// Throws Error{kInvalidArgument} unless the key view's luminance is one plane of finite values.
// `user`: what needs it, for the message.
void RequireFiniteLuminance(const Image& luminance, const char* user);
// Throws Error{kInvalidArgument} naming an entry that is malformed or lies outside the picture of
// this size. Reports contradicting hints as one warning.
HintMap DrawHints(const std::vector<ColorHint>& hints,
                  const HintPictures& pictures,
                  int width,
                  int height,
                  ProgressObserver& progress,
                  const CancellationToken& cancel);
// Hints from a strokes picture, as in KeyColorFromStrokes.
HintMap HintsFromStrokes(const Image& strokes);
// The hints on a smaller grid. A cell with any hinted pixel is hinted, so that thin strokes
// survive, and has their mean colour.
HintMap ReduceHints(const HintMap& full, int width, int height);

}  // namespace color3d
