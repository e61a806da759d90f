// A caption below a picture. Pure function, thread-safe.
#pragma once

#include <string>

#include "core/base/image.h"

namespace color3d {

// Returns the picture (1 or 3 channels, sRGB 0..1) with a white strip below it that holds `text`,
// broken into lines. Other Latin letters appear in ASCII (ü as ue). Throws Error{kInvalidArgument}
// for scripts that the strip cannot show, and for pictures narrower than 100 px.
Image WithCaption(const Image& picture, const std::string& text);

}  // namespace color3d
