// Hints drawn onto a photo's pixels. Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/image.h"
#include "core/base/progress.h"
#include "core/keycolor/hints/hints.h"

namespace color3d {

struct HintMap {
  std::vector<uint8_t> hinted;  // 1 where the colour is given
  Image ab;                     // 2 channels; read where hinted
};

// Throws Error{kInvalidArgument} naming the entry that lies outside of the picture of this size or
// is malformed. Contradicting hints are reported as one warning.
HintMap DrawHints(const std::vector<ColorHint>& hints,
                  const HintPictures& pictures,
                  int width,
                  int height,
                  ProgressObserver& progress,
                  const CancellationToken& cancel);
// Strokes as KeyColorFromStrokes takes them.
HintMap HintsOfStrokes(const Image& strokes);

}  // namespace color3d
