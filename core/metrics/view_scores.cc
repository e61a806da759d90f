#include "core/metrics/view_scores.h"

#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/metrics/quality.h"
#include "core/metrics/rank_correlation.h"

namespace color3d {
namespace {

// True L with other chroma: a colour error that a luminance error cannot hide.
Image UnderTrueL(const Image& true_lab, const Image& ab) {
  return JoinLab(LuminanceOfLab(true_lab), Resize(ab, true_lab.width, true_lab.height));
}

// In two steps, whatever the size of the picture: a truth that is reduced in one holds detail that
// one reduced in two does not.
Image AtColorSide(const Image& image) {
  return FitWithin(FitWithin(image, kScoreSidePx), kColorSidePx);
}

LabColor Pixel(const Image& lab, size_t i) {
  return {lab.Plane(0)[i], lab.Plane(1)[i], lab.Plane(2)[i]};
}

}  // namespace

Scores ScoreView(const Image& true_srgb, const Image& rendered_lab, const Image& view_ab) {
  Scores v;
  const Image true_lab = FitWithin(LabFromSrgb(true_srgb), kScoreSidePx);
  const Image lab = FitWithin(rendered_lab, kScoreSidePx);
  const Image truth_srgb = SrgbFromLab(true_lab);
  const Image rendered_srgb = SrgbFromLab(lab);
  v["psnr_rgb"] = Psnr(rendered_srgb, truth_srgb, 1.0);
  v["ssim_rgb"] = Ssim(rendered_srgb, truth_srgb, 1.0);
  v["psnr_l"] = Psnr(LuminanceOfLab(lab), LuminanceOfLab(true_lab), 100.0);
  v["ab_rmse"] = AbRmse(lab, true_lab);
  v["colorfulness"] = Colorfulness(rendered_srgb);
  v["colorfulness_2d"] = Colorfulness(SrgbFromLab(UnderTrueL(true_lab, view_ab)));
  v["colorfulness_truth"] = Colorfulness(truth_srgb);

  const Image truth = FitWithin(true_lab, kColorSidePx);
  const Image rendered = FitWithin(lab, kColorSidePx);
  v["delta_e00"] = MeanDeltaE00(rendered, truth);
  v["delta_e00_chroma"] = MeanDeltaE00(UnderTrueL(truth, ChromaOfLab(rendered)), truth);
  v["delta_e00_chroma_2d"] = MeanDeltaE00(UnderTrueL(truth, AtColorSide(view_ab)), truth);
  v["delta_e00_gray"] = MeanDeltaE00(UnderTrueL(truth, Image(truth.width, truth.height, 2)), truth);
  return v;
}

double ChromaError(const Image& true_srgb, const Image& rendered_lab) {
  const Image truth = AtColorSide(LabFromSrgb(true_srgb));
  const Image rendered = AtColorSide(rendered_lab);
  return MeanDeltaE00(UnderTrueL(truth, ChromaOfLab(rendered)), truth);
}

int SourceOf(float guessed, float seen, float inferred) {
  constexpr float kHalf = 127.5f / 255.0f;
  if (seen > kHalf) return 1;
  return inferred >= guessed ? 2 : 0;
}

void SourceErrors::Add(const Image& true_srgb, const Image& view_ab, const Image& provenance) {
  const Image truth = AtColorSide(LabFromSrgb(true_srgb));
  const Image delivered = UnderTrueL(truth, AtColorSide(view_ab));
  const Image shares = Resize(provenance, truth.width, truth.height);
  for (size_t i = 0; i < truth.PlaneSize(); ++i) {
    const float guessed = shares.Plane(0)[i], seen = shares.Plane(1)[i],
                inferred = shares.Plane(2)[i];
    errors_.push_back(static_cast<float>(DeltaE00(Pixel(delivered, i), Pixel(truth, i))));
    confidence_.push_back(seen + 0.5f * inferred);
    source_.push_back(static_cast<char>(SourceOf(guessed, seen, inferred)));
  }
}

Scores SourceErrors::Result() const {
  Scores scores;
  if (Empty()) return scores;
  double sum[3] = {0.0, 0.0, 0.0};
  double count[3] = {0.0, 0.0, 0.0};
  for (size_t i = 0; i < errors_.size(); ++i) {
    sum[static_cast<int>(source_[i])] += errors_[i];
    count[static_cast<int>(source_[i])] += 1.0;
  }
  for (int s = 0; s < 3; ++s) {
    const std::string source = kSourceNames[s];
    scores["share_" + source] = count[s] / static_cast<double>(errors_.size());
    if (count[s] > 0.0) scores["delta_e00_" + source] = sum[s] / count[s];
  }
  scores["confidence_rank_correlation"] = RankCorrelation(confidence_, errors_);
  return scores;
}

}  // namespace color3d
