// How good a drawn picture is. Internal to the splat module.
#pragma once

#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/training/loss.h"

namespace color3d {

struct PictureQuality {
  double psnr_db = 0.0;  // at most 99; peak 1, squared error over all channels
  double ssim = 0.0;
  double l1 = 0.0;
};

// `drawn` is clamped to 0..1 first, in place. `mask` (1 channel of 0 and 1, may be null): where
// pixels count; `drawn` becomes the truth elsewhere.
PictureQuality CompareClamped(const PlaneBuffer& truth,
                              const PlaneBuffer* mask,
                              ImageLoss& loss,
                              ThreadPool& pool,
                              PlaneBuffer& drawn);

// Sets all channels of `planes` to those of `other` where `mask` is 0. Of equal sizes.
void TakeWhereMasked(const PlaneBuffer& mask, const PlaneBuffer& other, PlaneBuffer& planes);
// To 0.
void ClearWhereMasked(const PlaneBuffer& mask, PlaneBuffer& planes);

Image ImageFromPlanes(const PlaneBuffer& planes);

}  // namespace color3d
