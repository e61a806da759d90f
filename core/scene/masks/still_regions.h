// What of a film's frame stands still, as its import saw it (DYNAMIC.md "Poses of films"). Pure
// functions, thread-safe.
#pragma once

#include "core/base/image.h"
#include "core/scene/view_images.h"

namespace color3d {

// 1 channel of the working size of `images`: 1 where nothing of `moving` is, else 0. `moving`: 1
// channel of any size, of the whole frame as captured; above 0.5 something moves on its own.
Image StillRegion(const ViewImages& images, const Scene& scene, int view, const Image& moving);

}  // namespace color3d
