// A dynamic scene in one file that web players stream and seek: .splat4d, version 1
// (github.com/adamraudonis/splats4D: docs: FORMAT, and converter/src/streams.rs for the header of a
// stream, which the document omits). A pure function.
#pragma once

#include <string>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

inline constexpr int kMaxSplat4dFrames = 18'000;

// Writes `frames` time steps, spread evenly over the model's time, 1..kMaxSplat4dFrames. As in
// .splat, numbers have 8 bits, except positions (precise to a twentieth of the median Gaussian's
// size) and sizes (to 1 %); opacities are precise to one step of 255. `rgb` gives its degree 0
// only. Omits Gaussians that no frame shows. Memory beside that of the file does not grow with
// `frames`. Throws Error{kInvalidArgument} if `frames` is out of range, if nothing is visible, for
// values that are not finite, and as ForViewers.
std::string EncodeSplat4d(const GaussianModel& model,
                          const RgbHarmonics& rgb,
                          const ExportFrame& frame,
                          int frames,
                          ThreadPool& pool);

}  // namespace color3d
