#include "core/colorizer/personal/personal_corrector.h"

#include <torch/types.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/colorizer/model/padding.h"
#include "core/colorizer/neighbors/known_cells.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/crop.h"
#include "core/image/guided_upsample.h"
#include "core/image/weighted_resize.h"

namespace color3d {
namespace {

constexpr uint64_t kSeed = 1;
constexpr int64_t kMaxObservedCells = 800;  // maximum number of cells over all corrections
constexpr int64_t kMinCells = 8;            // minimum number of cells of each correction
constexpr double kMinPaintedShare = 0.02;   // minimum painted share of a cell
constexpr double kMinChange = 3.0;          // minimum change of colour, Lab units
// The expected squared error of a colour grows with the squared distance to the training cells, up
// to this multiple of its median.
constexpr double kMinVariance = 0.1;
constexpr double kMaxUnlike = 4.0;

PlacedPicture Reduced(const PlacedPicture& picture, int max_side_px) {
  PlacedPicture small{FitWithin(picture.luminance, max_side_px), {}, {}, {}};
  const auto fit = [&](const Image& map) {
    return map.Empty() ? Image() : Resize(map, small.luminance.width, small.luminance.height);
  };
  small.ab = fit(picture.ab);
  small.position = fit(picture.position);
  small.seen = fit(picture.seen);
  return small;
}

torch::Tensor CellSeenShares(const Image& seen, int64_t count) {
  return seen.Empty() ? torch::zeros({count})
                      : CellMeans(PaddedTensor(seen)).squeeze(1).contiguous();
}

// Rows to observe. Half of them lie where the colour changes, so that colours that the user kept
// count too but do not outweigh the changes.
torch::Tensor RowsToObserve(const torch::Tensor& change,
                            const torch::Tensor& weights,
                            int64_t most,
                            Random& random) {
  const torch::Tensor touched = weights > kMinPaintedShare;
  const torch::Tensor changed = change.square().sum(1) > kMinChange * kMinChange;
  const auto draw = [&](const torch::Tensor& wanted) {
    const torch::Tensor rows = wanted.nonzero().squeeze(1);
    return rows.index_select(0, SampleRows(rows.size(0), most / 2, random));
  };
  return torch::cat({draw(torch::logical_and(touched, changed)),
                     draw(torch::logical_and(touched, changed.logical_not()))});
}

torch::Tensor Joined(std::span<const PlaceSample> samples,
                     std::vector<float> PlaceSample::*values,
                     int64_t rows) {
  std::vector<float> all;
  for (const PlaceSample& sample : samples) {
    all.insert(all.end(), (sample.*values).begin(), (sample.*values).end());
  }
  return torch::tensor(all).reshape({rows, -1});
}

// Expected error of the colour of each place.
torch::Tensor Deviation(const std::vector<float>& unlike) {
  std::vector<float> sorted = unlike;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  const double median = std::max(sorted[sorted.size() / 2], 1e-6f);
  const torch::Tensor apart = (torch::tensor(unlike) / median).clamp_max(kMaxUnlike);
  return (kMinVariance + apart.square()).sqrt();
}

}  // namespace

PersonalCorrector::PersonalCorrector(const TapEncoder& encoder,
                                     const FeatureNeighbors& learnt,
                                     RelativeChroma relative_chroma,
                                     int max_side_px,
                                     int threads,
                                     std::span<const Correction> corrections)
    : encoder_(encoder),
      learnt_(learnt),
      relative_chroma_(relative_chroma),
      max_side_px_(max_side_px),
      threads_(threads) {
  torch::NoGradGuard no_grad;
  std::vector<torch::Tensor> features, colors, positions, seen, wanted, weights, numbers, reaches;
  Random random(kSeed);
  const auto count = static_cast<int64_t>(corrections.size());
  for (int64_t number = 0; number < count; ++number) {
    const Correction& correction = corrections[number];
    const PlacedPicture small = Reduced(correction.picture, max_side_px_);
    const int width = small.luminance.width, height = small.luminance.height;
    // Current and target colours of painted places.
    const auto cells_of = [&](const Image& ab) {
      TrainingPicture picture{"",
                              small.luminance,
                              ResizeWeighted(ab, correction.painted, width, height),
                              Resize(correction.painted, width, height)};
      picture.position = small.position;
      return ComputeKnownCells(encoder_, picture, relative_chroma_);
    };
    const KnownCells cells = cells_of(correction.ab);
    const torch::Tensor before = cells_of(correction.picture.ab).colors;
    const torch::Tensor rows = RowsToObserve(cells.colors - before,
                                             cells.weights,
                                             std::max(2 * kMinCells, kMaxObservedCells / count),
                                             random);
    if (rows.size(0) == 0) {
      throw InvalidArgument(
          "correction {} of {} paints too small an area; paint a larger one", number + 1, count);
    }
    const KnownCells observed = Select(cells, rows);
    features.push_back(learnt_.whitening().Apply(observed.blocks));
    colors.push_back(before.index_select(0, rows));
    positions.push_back(observed.positions);
    seen.push_back(CellSeenShares(small.seen, cells.weights.size(0)).index_select(0, rows));
    wanted.push_back(observed.colors);
    weights.push_back(observed.weights);
    numbers.push_back(torch::full({rows.size(0)}, number, torch::kInt64));
    reaches.push_back(torch::full({rows.size(0)}, correction.reach, torch::kFloat32));
  }
  if (corrections.empty()) {
    field_.emplace(
        FieldPlaces{}, torch::zeros({0, 2}), torch::Tensor(), torch::Tensor(), torch::Tensor());
    return;
  }
  field_.emplace(
      FieldPlaces{
          torch::cat(features), torch::cat(colors), torch::cat(positions), torch::cat(seen)},
      torch::cat(wanted),
      torch::cat(weights),
      torch::cat(numbers),
      torch::cat(reaches));
}

PictureCells PersonalCorrector::Describe(const Image& luminance, const Image& position) const {
  return WithTorchErrors("correction", [&] {
    torch::NoGradGuard no_grad;
    SetTorchThreads(threads_);
    const PlacedPicture small = Reduced({luminance, {}, position, {}}, max_side_px_);
    const torch::Tensor padded = PaddedTensor(small.luminance);
    const CellFeatures cells =
        DescribeCells(encoder_.config(), encoder_.Taps(encoder_.Input(padded)), padded);
    return PictureCells{TensorValues(learnt_.whitening().Apply(cells.blocks)),
                        TensorValues(CellPositions(small.position, cells.Count()))};
  });
}

CorrectedColor PersonalCorrector::Predict(const PlacedPicture& picture,
                                          const PictureCells& cells,
                                          int samples) const {
  return WithTorchErrors("correction", [&] {
    torch::NoGradGuard no_grad;
    SetTorchThreads(threads_);
    const PlacedPicture small =
        Reduced({picture.luminance, picture.ab, {}, picture.seen}, max_side_px_);
    const torch::Tensor padded = PaddedTensor(small.luminance);
    const int64_t rows = padded.size(2) / kCellPx, columns = padded.size(3) / kCellPx;
    const int64_t count = rows * columns;
    const auto values = static_cast<int64_t>(cells.features.size());
    if (values == 0 || values % count != 0 || std::ssize(cells.positions) != 4 * count) {
      throw InvalidArgument("the cells are not those of a picture of {}x{} px",
                            picture.luminance.width,
                            picture.luminance.height);
    }
    const FieldPlaces places{
        torch::tensor(cells.features).reshape({count, -1}),
        CellMeans(PaddedTensor(ToRelative(relative_chroma_, small.luminance, small.ab))),
        torch::tensor(cells.positions).reshape({count, 4}),
        CellSeenShares(small.seen, count)};
    const ChangeField::Answer answer = field_->At(places);
    const Image coarse =
        ImageFromTensor(torch::cat({answer.change, torch::stack({answer.share, answer.pull}, 1)}, 1)
                            .t()
                            .reshape({4, rows, columns}));
    const int width = picture.luminance.width, height = picture.luminance.height;
    Image fine = Crop(UpsampleGuided(coarse, ImageFromTensor(padded)),
                      0,
                      0,
                      small.luminance.width,
                      small.luminance.height);
    if (fine.width != width || fine.height != height) {
      fine = UpsampleGuided(fine, picture.luminance);
    }
    CorrectedColor color{
        Image(width, height, 2), Image(width, height, 1), Image(width, height, 1), {}};
    std::copy_n(fine.Plane(0), color.change.data.size(), color.change.Plane(0));
    const auto copy_share = [&](int plane, Image* share) {
      std::transform(fine.Plane(plane),
                     fine.Plane(plane) + fine.PlaneSize(),
                     share->Plane(0),
                     [](float value) { return std::clamp(value, 0.0f, 1.0f); });
    };
    copy_share(2, &color.share);
    copy_share(3, &color.pull);
    color.change = FromRelative(relative_chroma_, picture.luminance, std::move(color.change));
    if (samples > 0) color.sample = Sample(places, columns, small.luminance, samples);
    return color;
  });
}

PlaceSample PersonalCorrector::Sample(const FieldPlaces& places,
                                      int64_t columns,
                                      const Image& luminance,
                                      int wanted) const {
  const auto x = [&](int64_t cell) { return (cell % columns + 0.5) * kCellPx / luminance.width; };
  const auto y = [&](int64_t cell) { return (cell / columns + 0.5) * kCellPx / luminance.height; };
  std::vector<int64_t> inside;  // outside the padding
  for (int64_t cell = 0; cell < places.seen.size(0); ++cell) {
    if (x(cell) < 1.0 && y(cell) < 1.0) inside.push_back(cell);
  }
  Random random(kSeed);
  const torch::Tensor rows = torch::tensor(inside).index_select(
      0, SampleRows(static_cast<int64_t>(inside.size()), wanted, random));
  const FieldPlaces drawn{places.features.index_select(0, rows),
                          places.colors.index_select(0, rows),
                          places.positions.index_select(0, rows),
                          places.seen.index_select(0, rows)};
  VoteOptions nearest;
  nearest.max_voters = 1;
  const torch::Tensor unlike =
      MatchCells({drawn.features, drawn.positions}, learnt_.bank(), nearest).distance;
  PlaceSample sample;
  for (int64_t i = 0; i < rows.size(0); ++i) {
    const auto cell = rows[i].item<int64_t>();
    sample.places.push_back(
        {x(cell), y(cell), drawn.seen[i].item<float>(), unlike[i].item<float>()});
  }
  sample.features = TensorValues(drawn.features);
  sample.positions = TensorValues(drawn.positions);
  return sample;
}

std::vector<ProposedPlace> PersonalCorrector::Propose(std::span<const PlaceSample> samples,
                                                      int count) const {
  return WithTorchErrors("proposal", [&] {
    torch::NoGradGuard no_grad;
    SetTorchThreads(threads_);
    std::vector<std::pair<int, const PlaceSample::Place*>> places;
    std::vector<float> seen, unlike;
    for (size_t picture = 0; picture < samples.size(); ++picture) {
      for (const PlaceSample::Place& place : samples[picture].places) {
        places.emplace_back(static_cast<int>(picture), &place);
        seen.push_back(place.seen);
        unlike.push_back(place.unlike);
      }
    }
    std::vector<ProposedPlace> proposed;
    if (places.empty()) return proposed;
    const auto rows = static_cast<int64_t>(places.size());
    const FieldPlaces all{Joined(samples, &PlaceSample::features, rows),
                          torch::zeros({rows, 2}),
                          Joined(samples, &PlaceSample::positions, rows),
                          torch::tensor(seen)};
    for (const auto& [row, gain] : field_->Propose(all, Deviation(unlike), count)) {
      proposed.push_back({places[row].first, places[row].second->x, places[row].second->y, gain});
    }
    return proposed;
  });
}

}  // namespace color3d
