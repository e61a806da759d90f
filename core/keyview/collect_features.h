// What key view selection wants to know of every candidate, computed on all threads or taken from
// the cache.
#pragma once

#include <filesystem>
#include <vector>

#include "core/base/run_control.h"
#include "core/encoder/encoder.h"
#include "core/keyview/view_features.h"

namespace color3d {

// One entry a photo, the same bytes whether cached or not. Features are those of the photo as
// captured (its lens distortion hardly matters here), so that they stay valid when poses change: a
// photo is computed once for each encoder. `describer` gives the descriptor (it may be a CLIP image
// tower), `encoder` the deep features. `cache_folder`: kept between runs; empty: none. Throws Error
// naming a photo that cannot be read.
std::vector<ViewFeatures> CollectViewFeatures(const Encoder& describer,
                                              const Encoder& encoder,
                                              const std::vector<std::filesystem::path>& photos,
                                              const std::filesystem::path& cache_folder,
                                              const RunControl& run);

}  // namespace color3d
