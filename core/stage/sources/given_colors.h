// What a user gives of a photo: colours on some of its pixels. Functions without state.
#pragma once

#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/key_color_options.h"

namespace color3d {

struct GivenColors {
  Image ab;     // 2 channels, Lab units, size of the photo as captured
  Image given;  // 1 channel: 1 where that is the user's, else 0
};

// A photo in colours that it has on a smaller grid: what a user paints on. `srgb`: the photo as
// captured; `ab`: 2 channels, Lab units, any size. 3 channels, sRGB, of the photo's size.
Image PaintablePhoto(const Image& srgb, const Image& ab);

// Strokes (Source::kStrokes), points, lines and regions (kPoints), or a picture in colour (kImage):
// that counts where its alpha is above a half or, without transparent pixels, where it differs
// from PaintablePhoto(srgb, current_ab). `srgb`: the photo as captured. Pictures have its size;
// with transparent pixels also another one of its shape. Throws Error{kInvalidArgument} for other
// sources, what lies outside of the photo, and when no pixel is given.
GivenColors ReadGivenColors(const ColorizeKeyViewOptions& options,
                            const Image& srgb,
                            const Image& current_ab,
                            StageContext& context);

// Colours of the photo of `view` (2 channels, size as captured) that somebody gave as far as
// `given` (1 channel, 0..1) says, on the grid of `images`: what was not given does not leak into
// the edges of what was.
CarriedColor UndistortGiven(const Image& ab,
                            const Image& given,
                            int view,
                            const ViewImages& images);

}  // namespace color3d
