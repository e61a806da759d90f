// What the reconstruction itself costs: the same geometry under the true colours of the training
// views. For the evaluate stage only.
#pragma once

#include <filesystem>
#include <map>

#include "core/base/parallel.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/stage.h"

namespace color3d {

// `truth`: a colour photo for every training view, by view. Throws Error{kInvalidArgument} naming
// one that is missing, Error{kCancelled}.
GaussianModel FitTrueChroma(const GaussianModel& geometry,
                            const Scene& scene,
                            const std::map<int, std::filesystem::path>& truth,
                            int max_side_px,
                            const ChromaOptions& options,
                            ThreadPool& pool,
                            StageContext& context);

}  // namespace color3d
