// The paper's second half on fixed geometry: Adam on 0.8 L1 + 0.2 (1 - SSIM) of a', b', one view
// per iteration. Internal to the splat module.
#pragma once

#include <vector>

#include "core/splat/chroma/chroma_fitting.h"
#include "core/splat/chroma/chroma_targets.h"

namespace color3d {

// Improves `parameters` in place; `colored` are the positions in fitting.problem.training that have
// colours; `targets` gives them.
void TrainChromaWithAdam(const ChromaFitting& fitting,
                         const std::vector<int>& colored,
                         ChromaTargets& targets,
                         ChromaParameters& parameters);

}  // namespace color3d
