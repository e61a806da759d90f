// Initial chroma of both solvers, and chroma of Gaussians that no target sees. Internal to the
// splat module. Stateless except for the pool's threads.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/splat/chroma/chroma_parameters.h"
#include "core/splat/chroma/chroma_system.h"

namespace color3d {

// Visibility-weighted mean of the targets, sum(w alpha T t) / sum(w alpha T) for each Gaussian (the
// diagonal approximation of the normal equations), and FillUnseen. Coefficients above degree 0 are
// zero. Returns which Gaussians are seen.
std::vector<char> SetClosedForm(const ChromaSystem& system,
                                ThreadPool& pool,
                                ChromaParameters& parameters);

// Visibility-weighted mean of the targets' confidence, 0..1; 0 for Gaussians that are not seen.
std::vector<float> MeanConfidence(const ChromaSystem& system, const std::vector<char>& seen);

// Gaussians that no target pixel sees take the mean of their nearest visible neighbours (degree 0),
// weighted by proximity. Without any neighbour they are unchanged.
void FillUnseen(const std::vector<char>& seen, ThreadPool& pool, ChromaParameters& parameters);

}  // namespace color3d
