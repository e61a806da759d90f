// Error measures of a rendered picture. Internal to the splat module.
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

// Clamps `drawn` to 0..1 in place. `mask` (1 channel of 0 and 1, may be null): 1 where pixels
// count; elsewhere `drawn` is set to the truth.
PictureQuality CompareClamped(const PlaneBuffer& truth,
                              const PlaneBuffer* mask,
                              ImageLoss& loss,
                              ThreadPool& pool,
                              PlaneBuffer& drawn);

// Copies all channels of `other` to `planes` where `mask` is 0. Requires equal sizes.
void CopyMasked(const PlaneBuffer& mask, const PlaneBuffer& other, PlaneBuffer& planes);
// Sets all channels to 0 where `mask` is 0.
void ZeroMasked(const PlaneBuffer& mask, PlaneBuffer& planes);

Image ImageFromPlanes(const PlaneBuffer& planes);

}  // namespace color3d
