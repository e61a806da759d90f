// Picture quality against the truth (METHOD.md "Metrics"). Pure functions, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// 10 log10(peak^2 / mse) over all channels; +infinity is reported as 99.
double Psnr(const Image& x, const Image& y, double peak);
// Mean SSIM, 11x11 Gaussian window sigma 1.5, zero padding, K1 0.01, K2 0.03, mean over channels.
double Ssim(const Image& x, const Image& y, double peak);
// Root of the mean squared difference of a and b of two Lab images, Lab units.
double AbRmse(const Image& lab_x, const Image& lab_y);

}  // namespace color3d
