// Scores of one held-out view against its true colours (METHOD.md "Metrics"). Pure, thread-safe.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

using Scores = std::map<std::string, double>;

// Pictures are scored at this size, so that figures of all presets can be compared, and colour
// differences at the smaller one. Smaller pictures are scored as they are.
inline constexpr int kScoreSidePx = 500;
inline constexpr int kColorSidePx = 400;

// `true_srgb`: 3 channels; `rendered_lab`: of the same size; `view_ab`: any size. Means over the
// view's pixels. PSNR, SSIM and colourfulness at kScoreSidePx, "delta_e00*" (CIEDE2000) at
// kColorSidePx: of the render, of its chroma and of the view's own chroma under the true L, and of
// no chroma at all. `mask`: 1 channel of 0 and 1 of the truth's size, and only where it is 1 pixels
// count, also reduced ones of which a part does not; null: all count. Empty when none is left,
// which the functions below must not be asked for then.
Scores ScoreView(const Image& true_srgb,
                 const Image& rendered_lab,
                 const Image& view_ab,
                 const Image* mask = nullptr);

// Colourfulness of the pixels that count, at the picture's size.
double ColorfulnessWhere(const Image& srgb, const Image* mask);

// CIEDE2000 of the chroma of `rendered_lab` under the true L, at kColorSidePx.
double ChromaError(const Image& true_srgb, const Image& rendered_lab, const Image* mask = nullptr);

// Whether confidence means anything: errors of the delivered colour by where it comes from. A plain
// value.
class SourceErrors {
 public:
  // `provenance`: the view's 3 channels, shares of guessed, seen and inferred colour that sum to 1,
  // any size. `mask` as above; nothing is added when it leaves nothing.
  void Add(const Image& true_srgb,
           const Image& view_ab,
           const Image& provenance,
           const Image* mask = nullptr);
  bool Empty() const { return pixels_ == 0; }
  // "share_X" of the pixels and their mean "delta_e00_X" for X = seen (share above half), inferred
  // and guessed (whichever is the larger otherwise; no error for one that has no pixels), and
  // "confidence_rank_correlation" of confidence = seen + inferred / 2 with the error: -1 is best.
  Scores Result() const;

 private:
  int64_t pixels_ = 0;
  double sum_[3] = {0.0, 0.0, 0.0};  // of errors, by source
  double count_[3] = {0.0, 0.0, 0.0};
  // For the correlation: of very many pixels only every so manieth, so that memory does not grow
  // with the number of views.
  int64_t stride_ = 1;
  std::vector<float> errors_;
  std::vector<float> confidence_;
};

// Colour of the pixel: index into kSourceNames.
inline constexpr const char* kSourceNames[] = {"guessed", "seen", "inferred"};
int SourceOf(float guessed, float seen, float inferred);

}  // namespace color3d
