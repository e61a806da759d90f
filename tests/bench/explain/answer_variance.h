// Variance of a colorizer's answers over augmentations of one picture (V_psi of the paper's
// appendix; STILL.md "Consistency of the colorizer"). Torch in the interface. Pure functions.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <functional>

namespace color3d {

// Returns ab [1,2,h,w] in Lab units for L [1,1,H,W], H and W multiples of 32.
using Answer = std::function<torch::Tensor(const torch::Tensor& luminance)>;

struct AnswerSpread {
  double variance = 0.0;  // Lab units squared, mean over the places
  double chroma = 0.0;    // mean |ab| of the mean answers: variance falls with the colours
  double places = 0.0;    // share of the picture that is inside in half of the draws
};

// Mean over the places of the unbiased variance of the answers to `draws` random ViewChanges,
// mapped back to the picture. Requires: draws >= 2.
AnswerSpread MeasureSpread(const Answer& answer,
                           const torch::Tensor& luminance,
                           int draws,
                           uint64_t seed);

}  // namespace color3d
