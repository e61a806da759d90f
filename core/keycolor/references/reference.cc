#include "core/keycolor/references/reference.h"

#include <fmt/format.h>
#include <torch/types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/base/range_check.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/tap_encoder.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/torch_threads.h"
#include "core/grid/edge_weights.h"
#include "core/grid/grid_solver.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/image/image_checks.h"
#include "core/keycolor/picture_checks.h"
#include "core/keycolor/references/confidence.h"
#include "core/matching/cell_features.h"
#include "core/matching/whitening.h"

namespace color3d {
namespace {

constexpr int kMinSidePx = 16;
constexpr std::array<double, 3> kScales{
    0.75, 1.0, 1.33};  // scales of a reference, since sizes of things differ
constexpr int64_t kScaleSample = 500;
constexpr int kFirstTapStridePx = 2;  // stride of the embedded encoder's finest tap
// Vote among matches in other photos.
constexpr double kTemperature = 0.3;
constexpr int kLevels = 1024;  // bins of the histograms of L
// Minimum weight of a match. Regions without matches get the colour of their neighbors.
constexpr float kMinConfidence = 1e-4f;

void CheckInputs(const Image& luminance, const std::vector<Image>& references) {
  RequireLuminance(luminance, "the colouring of the key view");
  if (references.empty()) throw InvalidArgument("no reference picture; give at least one");
  for (size_t k = 0; k < references.size(); ++k) {
    const Image& picture = references[k];
    const std::string name = fmt::format("reference picture {}", k);
    if (picture.channels != 3) {
      throw InvalidArgument("{} has no colour ({} channels, 3 are needed)", name, picture.channels);
    }
    if (std::min(picture.width, picture.height) < kMinSidePx) {
      throw InvalidArgument(
          "{} is {} px; sides must have at least {} px", name, SizeText(picture), kMinSidePx);
    }
    if (!IsFinite(picture)) throw InvalidArgument("{} has a value that is not finite", name);
  }
}

int HistogramBin(float l) {
  return std::clamp(static_cast<int>(l * (kLevels / 100.0f)), 0, kLevels - 1);
}

// L of the reference, mapped monotonically to the histogram of the key view, since exposure and
// development differ between photos.
Image MatchHistogram(const Image& luminance, const Image& key) {
  const auto cumulate = [](const Image& picture) {
    std::vector<double> sums(kLevels, 0.0);
    for (float l : picture.data)
      sums[HistogramBin(l)] += 1.0 / static_cast<double>(picture.data.size());
    std::partial_sum(sums.begin(), sums.end(), sums.begin());
    return sums;
  };
  const std::vector<double> from = cumulate(luminance), to = cumulate(key);
  std::vector<float> map(kLevels);
  for (int i = 0; i < kLevels; ++i) {
    const double middle = 0.5 * (from[i] + (i > 0 ? from[i - 1] : 0.0));
    const auto at = std::lower_bound(to.begin(), to.end(), middle) - to.begin();
    map[i] =
        (static_cast<float>(std::min<std::ptrdiff_t>(at, kLevels - 1)) + 0.5f) * (100.0f / kLevels);
  }
  Image matched = luminance;
  for (float& l : matched.data) l = map[HistogramBin(l)];
  return matched;
}

// Cells of a picture, with features of the encoder.
CellFeatures Describe(const TapEncoder& encoder, const Image& luminance) {
  const ConvNextConfig& config = encoder.config();
  const torch::Tensor l = TensorFromImage(luminance);
  const torch::Tensor padded = PadByReplication(l, config.Stride(config.StageCount() - 1));
  return DescribeCells(config, encoder.Taps(encoder.Input(padded)), l);
}

// Cells of the references, before whitening.
struct ReferenceCells {
  std::vector<std::vector<torch::Tensor>> blocks;  // by block of features, then by picture
  std::vector<torch::Tensor> colors;
  std::vector<int32_t> reference;  // reference of each cell
};

// Samples at most `wanted` cells of a reference at one scale.
void AddCells(const TapEncoder& encoder,
              const Image& luminance,
              const Image& ab,
              int32_t reference,
              int64_t wanted,
              Random& random,
              ReferenceCells& cells) {
  const CellFeatures features = Describe(encoder, luminance);
  const torch::Tensor rows = SampleRows(features.Count(), std::max<int64_t>(1, wanted), random);
  const std::vector<torch::Tensor> selected = SelectRows(features.blocks, rows);
  cells.blocks.resize(selected.size());
  for (size_t k = 0; k < selected.size(); ++k) cells.blocks[k].push_back(selected[k]);
  cells.colors.push_back(CellMeans(TensorFromImage(ab)).index_select(0, rows));
  cells.reference.insert(cells.reference.end(), rows.size(0), reference);
}

ReferenceCells SampleReferenceCells(const std::vector<Image>& references,
                                    const Image& key_luminance,
                                    const TapEncoder& encoder,
                                    const ReferenceOptions& options,
                                    const CancellationToken& cancel) {
  ReferenceCells cells;
  Random random(options.seed);
  const int64_t pictures = static_cast<int64_t>(references.size() * kScales.size());
  const int64_t wanted = (options.bank_size + pictures - 1) / pictures;
  for (size_t k = 0; k < references.size(); ++k) {
    const Image lab = LabFromSrgb(FitWithin(references[k], options.match_side_px));
    ExpectColor(lab, fmt::format("reference picture {}", k).c_str());
    const Image luminance = MatchHistogram(LuminanceOfLab(lab), key_luminance);
    const Image ab = ChromaOfLab(lab);
    for (double scale : kScales) {
      cancel.ThrowIfCancelled();
      const auto scaled = [scale](int side) {
        return std::max(kCellPx, static_cast<int>(std::lround(side * scale)));
      };
      const int width = scaled(lab.width), height = scaled(lab.height);
      AddCells(encoder,
               Resize(luminance, width, height),
               Resize(ab, width, height),
               static_cast<int32_t>(k),
               wanted,
               random,
               cells);
    }
  }
  return cells;
}

// Colours of the key view's cells from those of the references.
struct KeyMatches {
  Image ab;                        // one pixel per cell
  Image confidence;                // 0..1, one pixel per cell
  std::vector<int32_t> reference;  // reference of the nearest cell
};

KeyMatches Match(const std::vector<Image>& references,
                 const Image& luminance,
                 const TapEncoder& encoder,
                 const ReferenceOptions& options,
                 const RunControl& control) {
  torch::NoGradGuard no_grad;
  SetTorchThreads(control.pool.thread_count(), /*blas_threads=*/1);
  control.progress.OnProgress(0, 0, "describing the reference pictures");
  const ReferenceCells known =
      SampleReferenceCells(references, luminance, encoder, options, control.cancel);
  std::vector<torch::Tensor> blocks;
  for (const std::vector<torch::Tensor>& parts : known.blocks) blocks.push_back(torch::cat(parts));
  // Shares follow the order of the taps, even if the finest one has a larger stride.
  const Whitening whitening(blocks, kFirstTapStridePx, {});
  const CellBank bank{whitening.Apply(blocks),
                      torch::cat(known.colors),
                      torch::ones({static_cast<int64_t>(known.reference.size())})};
  const CellFeatures cells = Describe(encoder, luminance);
  const double scale = DistanceScale(
      bank.features.slice(0, 0, std::min(kScaleSample, bank.features.size(0))), bank.features);
  control.progress.OnProgress(0, 0, "matching the reference pictures");
  const CellMatches matches = MatchCells({whitening.Apply(cells.blocks)},
                                         bank,
                                         {.temperature = kTemperature,
                                          .distance_floor = kDistanceFloor,
                                          .max_voters = options.neighbors},
                                         control.cancel,
                                         /*with_bank_distance=*/true);
  const auto picture_of = [&](const torch::Tensor& by_cell) {
    return ImageFromTensor(by_cell.t().reshape({-1, cells.rows, cells.columns}));
  };
  KeyMatches found{picture_of(matches.ab),
                   picture_of(Confidence(matches, scale).unsqueeze(1)),
                   std::vector<int32_t>(matches.nearest.size(0))};
  const int64_t* nearest = matches.nearest.data_ptr<int64_t>();
  for (size_t i = 0; i < found.reference.size(); ++i) {
    found.reference[i] = known.reference[nearest[i]];
  }
  return found;
}

const TapEncoder& RequireTaps(const Encoder& encoder) {
  const auto* network = dynamic_cast<const TapEncoder*>(&encoder);
  if (network != nullptr) return *network;
  throw InvalidArgument("the encoder ({}) has no feature maps; use a ConvNeXt or the embedded one",
                        encoder.description());
}

// Propagates the matches along the luminance, weighted by their confidence.
void Spread(const Image& luminance,
            const KeyMatches& matches,
            const ReferenceOptions& options,
            const RunControl& control,
            ReferenceSolution& solution) {
  const Image small = FitWithin(luminance, options.spread_side_px);
  GridSystem system = SystemOfLuminance(small, options.sigma, control.pool);
  const Image ab = Resize(matches.ab, small.width, small.height);
  const Image confidence = Resize(matches.confidence, small.width, small.height);
  for (int64_t i = 0; i < system.PixelCount(); ++i) {
    system.data[i] =
        static_cast<float>(options.match_weight) * std::max(kMinConfidence, confidence.data[i]);
  }
  GridSolution solved = SolveGridSystem(
      std::move(system),
      ab.data,
      {},
      control.pool,
      [&](int iteration, double residual) {
        control.progress.OnError(iteration, "relative_residual", residual);
        control.progress.OnProgress(iteration, 0, "spreading the reference's colours");
      },
      control.cancel);
  solution.iterations = solved.iterations;
  solution.relative_residual = solved.relative_residual;
  Image spread(small.width, small.height, 2);
  spread.data = std::move(solved.u);
  const bool same = small.width == luminance.width && small.height == luminance.height;
  solution.ab = same ? std::move(spread) : UpsampleGuided(spread, luminance);
  solution.confidence = Resize(matches.confidence, luminance.width, luminance.height);
}

// Sets mean confidence and the share of each reference in it. Fades chroma if the references do not
// resemble this picture.
void WeighReferences(const KeyMatches& matches,
                     size_t references,
                     const ReferenceOptions& options,
                     ProgressObserver& progress,
                     ReferenceSolution& solution) {
  const std::vector<float>& confidence = matches.confidence.data;
  solution.explained.assign(references, 0.0);
  double total = 0.0;
  for (size_t i = 0; i < confidence.size(); ++i) {
    solution.explained[matches.reference[i]] += confidence[i];
    total += confidence[i];
  }
  for (double& share : solution.explained) share = total > 0.0 ? share / total : 0.0;
  solution.mean_confidence = total / static_cast<double>(confidence.size());
  if (solution.mean_confidence >= options.low_confidence) return;
  const double fade = std::pow(solution.mean_confidence / options.low_confidence, 2);
  progress.OnWarning(fmt::format(
      "the reference pictures do not resemble the key view (mean confidence {:.3g}, expected {} or "
      "more): chroma is scaled by {:.3g}; give a picture of the same place or things",
      solution.mean_confidence,
      options.low_confidence,
      fade));
  for (float& value : solution.ab.data) value *= static_cast<float>(fade);
}

}  // namespace

void ReferenceOptions::Validate() const {
  const RangeCheck check("reference option");
  check("match_side_px", match_side_px, 64, 1024);
  check("spread_side_px", spread_side_px, 64, 8192);
  check("bank_size", bank_size, 100, 100000);
  check("neighbors", neighbors, 1, 64);
  check("sigma", sigma, 1e-3, 1e3);
  check("match_weight", match_weight, 1e-6, 1e3);
  check("low_confidence", low_confidence, 1e-6, 1.0);
}

ReferenceSolution KeyColorFromReferences(const Image& luminance,
                                         const std::vector<Image>& references_srgb,
                                         const Encoder& encoder,
                                         const ReferenceOptions& options,
                                         const RunControl& control) {
  options.Validate();
  CheckInputs(luminance, references_srgb);
  const TapEncoder& taps = RequireTaps(encoder);
  const KeyMatches matches = WithTorchErrors("matching of reference pictures", [&] {
    return Match(
        references_srgb, FitWithin(luminance, options.match_side_px), taps, options, control);
  });
  ReferenceSolution solution;
  Spread(luminance, matches, options, control, solution);
  WeighReferences(matches, references_srgb.size(), options, control.progress, solution);
  return solution;
}

}  // namespace color3d
