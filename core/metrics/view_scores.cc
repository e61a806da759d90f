#include "core/metrics/view_scores.h"

#include <algorithm>
#include <cmath>

#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/metrics/quality.h"
#include "core/metrics/rank_correlation.h"
#include "core/scene/photo_masks.h"

namespace color3d {
namespace {

// The true L with the given chroma, so that luminance errors do not hide colour errors.
Image WithTrueLuminance(const Image& true_lab, const Image& ab) {
  return JoinLab(LuminanceOfLab(true_lab), Resize(ab, true_lab.width, true_lab.height));
}

// Always reduces in two steps, because the detail that is left depends on the number of steps.
Image AtColorSide(const Image& image) {
  return FitWithin(FitWithin(image, kScoreSidePx), kColorSidePx);
}

LabColor Pixel(const Image& lab, size_t i) {
  return {lab.Plane(0)[i], lab.Plane(1)[i], lab.Plane(2)[i]};
}

// Indices of the pixels of a picture of this size that lie wholly within `mask`; all if it is null.
std::vector<size_t> Counting(const Image* mask, int width, int height) {
  std::vector<size_t> pixels;
  const Image reduced =
      mask == nullptr ? Image(width, height, 1, 1.0f) : ResizeMask(*mask, width, height);
  for (size_t i = 0; i < reduced.data.size(); ++i) {
    if (reduced.data[i] > 0.0f) pixels.push_back(i);
  }
  return pixels;
}

// The given pixels in one row, for means over them.
Image Gather(const Image& image, const std::vector<size_t>& pixels) {
  Image row(static_cast<int>(pixels.size()), 1, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (size_t k = 0; k < pixels.size(); ++k) row.Plane(c)[k] = image.Plane(c)[pixels[k]];
  }
  return row;
}

// Mean over the given pixels. The other pixels are set to the truth.
double MaskedSsim(const Image& drawn, const Image& truth, const std::vector<size_t>& pixels) {
  if (pixels.size() == truth.PlaneSize()) return Ssim(drawn, truth, 1.0);
  Image composed = truth;
  for (int c = 0; c < truth.channels; ++c) {
    for (const size_t i : pixels) composed.Plane(c)[i] = drawn.Plane(c)[i];
  }
  const double share = static_cast<double>(pixels.size()) / static_cast<double>(truth.PlaneSize());
  return 1.0 - (1.0 - Ssim(composed, truth, 1.0)) / share;
}

constexpr double kHighPercentile = 0.9;

// Nearest rank. Requires: there are values.
double Percentile(std::vector<double> values, double share) {
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  const auto at = values.begin() + (std::max<int64_t>(1, static_cast<int64_t>(rank)) - 1);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::vector<double> DeltaE00OfPixels(const Image& lab_x,
                                     const Image& lab_y,
                                     const std::vector<size_t>& pixels) {
  std::vector<double> errors;
  errors.reserve(pixels.size());
  for (const size_t i : pixels) errors.push_back(DeltaE00(Pixel(lab_x, i), Pixel(lab_y, i)));
  return errors;
}

constexpr size_t kMostRanked = 1 << 20;  // even

void KeepEverySecond(std::vector<float>* values) {
  for (size_t i = 0; i < values->size() / 2; ++i) (*values)[i] = (*values)[2 * i];
  values->resize(values->size() / 2);
}

}  // namespace

Scores ScoreView(const Image& true_srgb,
                 const Image& rendered_lab,
                 const Image& view_ab,
                 const Image* mask) {
  Scores v;
  const Image true_lab = FitWithin(LabFromSrgb(true_srgb), kScoreSidePx);
  const Image lab = FitWithin(rendered_lab, kScoreSidePx);
  const Image truth_srgb = SrgbFromLab(true_lab);
  const Image rendered_srgb = SrgbFromLab(lab);
  const Image truth = FitWithin(true_lab, kColorSidePx);
  const std::vector<size_t> pixels = Counting(mask, true_lab.width, true_lab.height);
  const std::vector<size_t> of_color = Counting(mask, truth.width, truth.height);
  if (pixels.empty() || of_color.empty()) return v;
  const auto counting = [&](const Image& image) { return Gather(image, pixels); };
  v["psnr_rgb"] = Psnr(counting(rendered_srgb), counting(truth_srgb), 1.0);
  v["ssim_rgb"] = MaskedSsim(rendered_srgb, truth_srgb, pixels);
  v["psnr_l"] = Psnr(counting(LuminanceOfLab(lab)), counting(LuminanceOfLab(true_lab)), 100.0);
  v["ab_rmse"] = AbRmse(counting(lab), counting(true_lab));
  const auto add_colorfulness = [&](const char* suffix, const Image& srgb) {
    const Image row = counting(srgb);
    v[std::string("colorfulness") + suffix] = Colorfulness(row);
    v[std::string("colorfulness_absolute") + suffix] = AbsoluteColorfulness(row);
  };
  add_colorfulness("", rendered_srgb);
  add_colorfulness("_2d", SrgbFromLab(WithTrueLuminance(true_lab, view_ab)));
  add_colorfulness("_truth", truth_srgb);

  const Image rendered = FitWithin(lab, kColorSidePx);
  const auto error = [&](const Image& ab) {
    return MeanDeltaE00(Gather(WithTrueLuminance(truth, ab), of_color), Gather(truth, of_color));
  };
  v["delta_e00"] = MeanDeltaE00(Gather(rendered, of_color), Gather(truth, of_color));
  v["delta_e00_chroma"] = error(ChromaOfLab(rendered));
  v["delta_e00_chroma_p90"] =
      Percentile(DeltaE00OfPixels(WithTrueLuminance(truth, ChromaOfLab(rendered)), truth, of_color),
                 kHighPercentile);
  v["delta_e00_chroma_2d"] = error(AtColorSide(view_ab));
  v["delta_e00_gray"] = error(Image(truth.width, truth.height, 2));
  return v;
}

double MaskedColorfulness(const Image& srgb, const Image* mask) {
  return Colorfulness(Gather(srgb, Counting(mask, srgb.width, srgb.height)));
}

double ChromaError(const Image& true_srgb, const Image& rendered_lab, const Image* mask) {
  const Image truth = AtColorSide(LabFromSrgb(true_srgb));
  const Image rendered = AtColorSide(rendered_lab);
  const std::vector<size_t> pixels = Counting(mask, truth.width, truth.height);
  return MeanDeltaE00(Gather(WithTrueLuminance(truth, ChromaOfLab(rendered)), pixels),
                      Gather(truth, pixels));
}

int SourceOf(float guessed, float seen, float inferred) {
  constexpr float kHalf = 127.5f / 255.0f;
  if (seen > kHalf) return 1;
  return inferred >= guessed ? 2 : 0;
}

void SourceErrors::Add(const Image& true_srgb,
                       const Image& view_ab,
                       const Image& provenance,
                       const Image* mask) {
  const Image truth = AtColorSide(LabFromSrgb(true_srgb));
  const Image delivered = WithTrueLuminance(truth, AtColorSide(view_ab));
  const Image shares = Resize(provenance, truth.width, truth.height);
  for (const size_t i : Counting(mask, truth.width, truth.height)) {
    const float guessed = shares.Plane(0)[i], seen = shares.Plane(1)[i],
                inferred = shares.Plane(2)[i];
    const double error = DeltaE00(Pixel(delivered, i), Pixel(truth, i));
    const int source = SourceOf(guessed, seen, inferred);
    sum_[source] += error;
    count_[source] += 1.0;
    if (pixels_++ % stride_ != 0) continue;
    errors_.push_back(static_cast<float>(error));
    confidence_.push_back(seen + 0.5f * inferred);
    if (errors_.size() < kMostRanked) continue;
    KeepEverySecond(&errors_);
    KeepEverySecond(&confidence_);
    stride_ *= 2;
  }
}

Scores SourceErrors::Result() const {
  Scores scores;
  if (Empty()) return scores;
  for (int s = 0; s < 3; ++s) {
    const std::string source = kSourceNames[s];
    scores["share_" + source] = count_[s] / static_cast<double>(pixels_);
    if (count_[s] > 0.0) scores["delta_e00_" + source] = sum_[s] / count_[s];
  }
  scores["confidence_rank_correlation"] = RankCorrelation(confidence_, errors_);
  return scores;
}

}  // namespace color3d
