// Scores of a held-out view against its true colours (METHOD.md "Metrics"). Pure functions.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

using Scores = std::map<std::string, double>;

// Maximum longer side of scored pictures, equal for all presets, and of those of which colour
// differences are taken. Smaller pictures are not enlarged.
inline constexpr int kScoreSidePx = 500;
inline constexpr int kColorSidePx = 400;

// Means over the pixels of a view: PSNR, SSIM and colourfulness at kScoreSidePx, "delta_e00*"
// (CIEDE2000) at kColorSidePx for the render, for its chroma and for the predicted chroma of the
// view under the true L, and for no chroma. `true_srgb`: 3 channels; `rendered_lab`: of the same
// size; `view_ab`: any size. `mask`: 1 channel of the size of the truth; pixels count where it is
// 1, reduced pixels only if all of their parts do; null: all pixels count. Returns no scores if no
// pixel counts.
//
// "delta_e00_chroma_p90": 90th percentile over the pixels (nearest rank) in place of the mean.
Scores ScoreView(const Image& true_srgb,
                 const Image& rendered_lab,
                 const Image& view_ab,
                 const Image* mask = nullptr);

// Colourfulness of the pixels that count, at the size of the picture. Requires: a pixel counts.
double MaskedColorfulness(const Image& srgb, const Image* mask);

// CIEDE2000 of the chroma of `rendered_lab` under the true L, at kColorSidePx. Requires: a pixel
// counts.
double ChromaError(const Image& true_srgb, const Image& rendered_lab, const Image* mask = nullptr);

// Colour errors by the source of the colour, and how well confidence predicts them. A plain value.
class SourceErrors {
 public:
  // `provenance`: 3 channels of any size, shares of guessed, seen and inferred colour that sum
  // to 1. `mask`: as for ScoreView; adds nothing if no pixel counts.
  void Add(const Image& true_srgb,
           const Image& view_ab,
           const Image& provenance,
           const Image* mask = nullptr);
  bool Empty() const { return pixels_ == 0; }
  // Share of the pixels "share_X" and their mean error "delta_e00_X" for the source X (SourceOf; no
  // error for a source without pixels), and "confidence_rank_correlation" of the shown confidence
  // (seen + inferred / 2) with the error: -1 is best.
  Scores Result() const;

 private:
  int64_t pixels_ = 0;
  double sum_[3] = {0.0, 0.0, 0.0};  // of errors by source
  double count_[3] = {0.0, 0.0, 0.0};
  // For the correlation, every stride_-th pixel: memory does not grow with the number of views.
  int64_t stride_ = 1;
  std::vector<float> errors_;
  std::vector<float> confidence_;
};

// Colour of the pixel: index into kSourceNames.
inline constexpr const char* kSourceNames[] = {"guessed", "seen", "inferred"};
int SourceOf(float guessed, float seen, float inferred);

}  // namespace color3d
