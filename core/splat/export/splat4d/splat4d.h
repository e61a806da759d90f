// A scene that moves in one file that web players stream and seek: .splat4d, version 1
// (github.com/adamraudonis/splats4D: docs: FORMAT, and converter/src/streams.rs for the header of
// a stream, which the document leaves out). A pure function.
#pragma once

#include <string>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

inline constexpr int kMaxSplat4dFrames = 18'000;

// Of `frames` moments, evenly over the model's time, 1..kMaxSplat4dFrames. As the .splat it says a
// Gaussian in 8 bits a number but for positions, to a twentieth of the median Gaussian's size, and
// sizes, to 1 %; opacities are right to one step of 255. `rgb` gives its degree 0 only. Gaussians
// that no frame shows are left out. Memory beside the file's does not grow with `frames`. Throws
// Error{kInvalidArgument} where `frames` is out of range, where nothing is there to be seen, for
// values that are not finite, and as ForViewers.
std::string EncodeSplat4d(const GaussianModel& model,
                          const RgbHarmonics& rgb,
                          const ExportFrame& frame,
                          int frames,
                          ThreadPool& pool);

}  // namespace color3d
