// Static regions of a film's frames, as found by import (DYNAMIC.md "Poses of films"). Pure
// functions, thread-safe.
#pragma once

#include "core/base/image.h"
#include "core/scene/view_images.h"

namespace color3d {

// Returns 1 channel at the working size of `images`: 0 where a pixel shows a part of `moving` above
// 0.5, else 1. `moving`: moving objects, 1 channel of any size, of the whole frame as captured.
Image StillRegion(const ViewImages& images, const Scene& scene, int view, const Image& moving);

}  // namespace color3d
