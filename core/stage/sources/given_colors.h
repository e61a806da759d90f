// Colours that a user gives some pixels of a photo. Stateless.
#pragma once

#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/correct_colors_options.h"

namespace color3d {

struct GivenColors {
  Image ab;            // 2 channels, Lab units, size of the photo as captured
  Image given;         // 1 channel: 1 where the user gave a colour, else 0
  double reach = 1.0;  // the largest one of the points, lines and regions
};

// Returns the photo in its present colours, for a user to paint on: 3 channels, sRGB. `srgb`: the
// photo as captured; `ab`: 2 channels, Lab units, any size.
Image PaintablePhoto(const Image& srgb, const Image& ab);

// Reads strokes; points, lines and regions; or a picture, which counts where its alpha is above a
// half or, without transparent pixels, where it differs from PaintablePhoto(srgb, current_ab).
// `srgb`: the photo as captured. Pictures have its size; with transparent pixels also another one
// of its shape. Throws Error{kInvalidArgument} for places outside of the photo, and when no pixel
// is given.
GivenColors ReadGivenColors(const PaintedColors& painted,
                            const Image& srgb,
                            const Image& current_ab,
                            StageContext& context);

// Blends `ab` into `colors` (both 2 channels) by `share` (1 channel, 0..1).
void MixIn(const Image& ab, const Image& share, Image* colors);

// Undistorts colours of the photo of `view` (2 channels, size as captured) to the size of `images`.
// `given`: 1 channel, 0..1, their weight, so that pixels without a colour do not leak into others.
CarriedColor UndistortGivenColors(const Image& ab,
                                  const Image& given,
                                  int view,
                                  const ViewImages& images);

}  // namespace color3d
