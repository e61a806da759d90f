// Small chroma fits for tests: random Gaussians in front of a few cameras, with random or constant
// targets.
#pragma once

#include <cstdint>

#include "core/splat/chroma/chroma_fit.h"

namespace color3d::chroma_problems {

inline constexpr int kWidth = 37, kHeight = 26;

// Looks along z from (-shift, 0.1 shift, 0).
PosedCamera CameraAt(int view, double shift, int width = kWidth, int height = kHeight);

// Visible to the cameras, 2 to 5 units in front of them.
GaussianModel RandomGaussians(int count, uint64_t seed);

// Random chroma and weights at every pixel.
ChromaProblem RandomProblem(int views, uint64_t seed);

// Constant chroma.
ChromaProblem ConstantProblem(int views, float a, float b, int width, int height);

// FitChroma without checkpoints and observers.
GaussianModel Fit(const GaussianModel& geometry,
                  const ChromaProblem& problem,
                  const ChromaOptions& options,
                  int threads = 2);

}  // namespace color3d::chroma_problems
