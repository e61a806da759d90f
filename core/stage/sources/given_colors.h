// What a user gives of a photo: colours on some of its pixels. Functions without state.
#pragma once

#include "core/base/image.h"
#include "core/stage/stages.h"

namespace color3d {

struct GivenColors {
  Image ab;     // 2 channels, Lab units, size of the photo as captured
  Image given;  // 1 channel: 1 where that is the user's, else 0
};

// Strokes (Source::kStrokes), points, lines and regions (kPoints), or a coloured picture, which
// counts where its alpha is above a half (kImage). `srgb`: the photo. Throws
// Error{kInvalidArgument} for other sources, what lies outside of the photo, and when no pixel is
// given.
GivenColors ReadGivenColors(const ColorizeKeyViewOptions& options,
                            const Image& srgb,
                            StageContext& context);

}  // namespace color3d
