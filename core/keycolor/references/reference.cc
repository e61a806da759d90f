#include "core/keycolor/references/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/base/range_check.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/grid/edge_weights.h"
#include "core/grid/grid_solver.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/keycolor/picture_checks.h"
#include "core/keycolor/references/cell_features.h"
#include "core/keycolor/references/cell_matches.h"

namespace color3d {
namespace {

constexpr int kMinSidePx = 16;
constexpr std::array<double, 3> kScales{0.75, 1.0, 1.33};  // of a reference: sizes of things differ
constexpr Eigen::Index kScaleSample = 500;
constexpr int kLevels = 1024;  // of the histograms of L
// Smallest weight of a match: regions without any get their neighbours' colour.
constexpr float kLeastConfidence = 1e-4f;

void CheckInputs(const Image& luminance, const std::vector<Image>& references) {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the key view's luminance must have 1 channel, it has " +
                          std::to_string(luminance.channels));
  }
  if (references.empty()) throw InvalidArgument("there is no reference picture; give at least one");
  for (size_t k = 0; k < references.size(); ++k) {
    const Image& picture = references[k];
    const std::string name = "reference picture " + std::to_string(k);
    if (picture.channels != 3) {
      throw InvalidArgument(name + " has no colour (" + std::to_string(picture.channels) +
                            " channels, 3 are needed)");
    }
    if (std::min(picture.width, picture.height) < kMinSidePx) {
      throw InvalidArgument(name + " is " + std::to_string(picture.width) + "x" +
                            std::to_string(picture.height) + " px, the least side is " +
                            std::to_string(kMinSidePx) + " px");
    }
    for (float value : picture.data) {
      if (!std::isfinite(value)) throw InvalidArgument(name + " holds a value that is not finite");
    }
  }
}

int LevelOf(float l) {
  return std::clamp(static_cast<int>(l * (kLevels / 100.0f)), 0, kLevels - 1);
}

// L of the reference, mapped monotonically so that its histogram becomes the key view's: exposure
// and development differ between two photos of a place.
Image MatchHistogram(const Image& luminance, const Image& key) {
  const auto cumulate = [](const Image& picture) {
    std::vector<double> sums(kLevels, 0.0);
    for (float l : picture.data) sums[LevelOf(l)] += 1.0 / static_cast<double>(picture.data.size());
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
  for (float& l : matched.data) l = map[LevelOf(l)];
  return matched;
}

struct RawBank {
  std::vector<CellMatrix> blocks;
  CellMatrix ab;
  std::vector<int32_t> reference;
};

void Append(CellMatrix& matrix, const CellMatrix& rows) {
  const Eigen::Index before = matrix.rows();
  matrix.conservativeResize(before + rows.rows(), rows.cols());
  matrix.bottomRows(rows.rows()) = rows;
}

CellMatrix TakeRows(const CellMatrix& matrix, const std::vector<Eigen::Index>& rows) {
  CellMatrix taken(static_cast<Eigen::Index>(rows.size()), matrix.cols());
  for (size_t i = 0; i < rows.size(); ++i) {
    taken.row(static_cast<Eigen::Index>(i)) = matrix.row(rows[i]);
  }
  return taken;
}

// Cells of one reference at one scale, at most `wanted` of them, drawn at random.
void AddCells(const Encoder& encoder,
              const Image& luminance,
              const Image& ab,
              int32_t reference,
              int64_t wanted,
              Random& random,
              RawBank& bank) {
  const CellFeatures cells = DescribeCells(encoder, luminance);
  const CellMatrix colors = CellMeans(ab);
  std::vector<Eigen::Index> rows(colors.rows());
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  const auto count = static_cast<int64_t>(rows.size());
  const int64_t taken = std::min(count, std::max<int64_t>(1, wanted));
  for (int64_t i = 0; i < taken; ++i) {
    std::swap(rows[i], rows[i + random.NextBelow(static_cast<uint32_t>(count - i))]);
  }
  rows.resize(taken);
  bank.blocks.resize(cells.blocks.size());
  for (size_t k = 0; k < cells.blocks.size(); ++k) {
    Append(bank.blocks[k], TakeRows(cells.blocks[k], rows));
  }
  Append(bank.ab, TakeRows(colors, rows));
  bank.reference.insert(bank.reference.end(), taken, reference);
}

RawBank BuildBank(const std::vector<Image>& references,
                  const Image& key_luminance,
                  const Encoder& encoder,
                  const ReferenceOptions& options,
                  const CancellationToken& cancel) {
  RawBank bank;
  Random random(options.seed);
  const int64_t pictures = static_cast<int64_t>(references.size() * kScales.size());
  const int64_t wanted = (options.bank_size + pictures - 1) / pictures;
  for (size_t k = 0; k < references.size(); ++k) {
    const Image lab = LabFromSrgb(FitWithin(references[k], options.match_side_px));
    ExpectColor(lab, ("reference picture " + std::to_string(k)).c_str());
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
               bank);
    }
  }
  return bank;
}

// Cells -> [rows, columns] picture of `channels` planes.
Image PictureOfCells(const CellMatrix& values, int columns, int rows) {
  Image picture(columns, rows, static_cast<int>(values.cols()));
  for (int c = 0; c < picture.channels; ++c) {
    for (Eigen::Index i = 0; i < values.rows(); ++i) picture.Plane(c)[i] = values(i, c);
  }
  return picture;
}

// The matches, spread along the luminance by their confidences.
void Spread(const Image& luminance,
            const Image& cell_ab,
            const Image& cell_confidence,
            const ReferenceOptions& options,
            ThreadPool& pool,
            ProgressObserver& progress,
            const CancellationToken& cancel,
            ReferenceSolution& solution) {
  const Image small = FitWithin(luminance, options.spread_side_px);
  GridSystem system = SystemOfLuminance(small, options.sigma, pool);
  const Image ab = Resize(cell_ab, small.width, small.height);
  const Image confidence = Resize(cell_confidence, small.width, small.height);
  for (int64_t i = 0; i < system.PixelCount(); ++i) {
    system.data[i] =
        static_cast<float>(options.match_weight) * std::max(kLeastConfidence, confidence.data[i]);
  }
  GridSolution solved = SolveGridSystem(
      std::move(system),
      ab.data,
      {},
      pool,
      [&](int iteration, double residual) {
        progress.OnError(iteration, "relative_residual", residual);
        progress.OnProgress(iteration, 0, "spreading the reference's colours");
      },
      cancel);
  solution.iterations = solved.iterations;
  solution.relative_residual = solved.relative_residual;
  Image spread(small.width, small.height, 2);
  spread.data = std::move(solved.u);
  const bool same = small.width == luminance.width && small.height == luminance.height;
  solution.ab = same ? std::move(spread) : UpsampleGuided(spread, luminance);
  solution.confidence = Resize(cell_confidence, luminance.width, luminance.height);
}

// Means, and chroma faded where the references say nothing about this picture.
void Judge(const CellMatches& matches,
           size_t references,
           const ReferenceOptions& options,
           ProgressObserver& progress,
           ReferenceSolution& solution) {
  solution.explained.assign(references, 0.0);
  double total = 0.0;
  for (size_t i = 0; i < matches.confidence.size(); ++i) {
    solution.explained[matches.reference[i]] += matches.confidence[i];
    total += matches.confidence[i];
  }
  for (double& share : solution.explained) share = total > 0.0 ? share / total : 0.0;
  solution.mean_confidence = total / static_cast<double>(matches.confidence.size());
  if (solution.mean_confidence >= options.low_confidence) return;
  const double fade = std::pow(solution.mean_confidence / options.low_confidence, 2);
  progress.OnWarning("the reference pictures hardly resemble the key view (mean confidence " +
                     std::to_string(solution.mean_confidence) + ", expected " +
                     std::to_string(options.low_confidence) + " or more): chroma is faded to " +
                     std::to_string(fade) +
                     " of itself; give a picture of the same place or things");
  for (float& value : solution.ab.data) value *= static_cast<float>(fade);
}

}  // namespace

void ReferenceOptions::Validate() const {
  const RangeCheck check("reference option");
  check("match_side_px", match_side_px, 64, 1024);
  check("spread_side_px", spread_side_px, 64, 8192);
  check("bank_size", bank_size, 100, 100000);
  check("neighbours", neighbours, 1, 64);
  check("sigma", sigma, 1e-3, 1e3);
  check("match_weight", match_weight, 1e-6, 1e3);
  check("low_confidence", low_confidence, 1e-6, 1.0);
  check("threads", threads, 0, 1024);
}

ReferenceSolution KeyColorFromReferences(const Image& luminance,
                                         const std::vector<Image>& references_srgb,
                                         const Encoder& encoder,
                                         const ReferenceOptions& options,
                                         ProgressObserver& progress,
                                         const CancellationToken& cancel) {
  options.Validate();
  CheckInputs(luminance, references_srgb);
  ThreadPool pool(options.threads);
  const Image small = FitWithin(luminance, options.match_side_px);
  progress.OnProgress(0, 0, "describing the reference pictures");
  RawBank raw = BuildBank(references_srgb, small, encoder, options, cancel);
  const Whitening whitening(raw.blocks);
  const CellBank bank{whitening.Apply(raw.blocks), std::move(raw.ab), std::move(raw.reference)};
  const CellFeatures cells = DescribeCells(encoder, small);
  const double scale = DistanceScale(
      bank.features.topRows(std::min(kScaleSample, bank.features.rows())), bank.features);
  progress.OnProgress(0, 0, "matching the reference pictures");
  const CellMatches matches =
      MatchCells(whitening.Apply(cells.blocks), bank, options.neighbours, scale, pool, cancel);
  ReferenceSolution solution;
  const CellMatrix confidence = Eigen::Map<const CellMatrix>(
      matches.confidence.data(), static_cast<Eigen::Index>(matches.confidence.size()), 1);
  Spread(luminance,
         PictureOfCells(matches.ab, cells.columns, cells.rows),
         PictureOfCells(confidence, cells.columns, cells.rows),
         options,
         pool,
         progress,
         cancel,
         solution);
  Judge(matches, references_srgb.size(), options, progress, solution);
  return solution;
}

}  // namespace color3d
