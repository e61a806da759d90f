// Features of all candidates for the key view, computed on all threads or read from a cache.
#pragma once

#include <filesystem>
#include <vector>

#include "core/base/run_control.h"
#include "core/encoder/encoder.h"
#include "core/keyview/view_features.h"

namespace color3d {

// Returns an entry per photo, with the same bytes whether cached or not. Features are those of the
// photo as captured (lens distortion has little effect), so that they remain valid if poses change
// and are computed once per photo and encoder. `describer` gives the descriptor (it may be the
// image tower of CLIP), `encoder` the deep features. `cache_folder`: kept between runs; empty:
// none. Throws Error naming a photo that cannot be read.
std::vector<ViewFeatures> CollectViewFeatures(const Encoder& describer,
                                              const Encoder& encoder,
                                              const std::vector<std::filesystem::path>& photos,
                                              const std::filesystem::path& cache_folder,
                                              const RunControl& run);

}  // namespace color3d
