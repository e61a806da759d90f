#include "core/colorizer/neighbors/feature_neighbors.h"

#include <fmt/format.h>
#include <torch/types.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/base/ordered_rounds.h"
#include "core/colorizer/neighbors/known_cells.h"
#include "core/encoder/torch_threads.h"
#include "core/matching/view_noise.h"

namespace color3d {
namespace {

constexpr char kPrefix[] = "neighbors.";
constexpr int64_t kOpenCells = 200;  // of a picture, whose matches are measured

// Cells of all pictures but the first, the key view.
struct AdditionalCells {
  std::vector<KnownCells> sure;  // of certain colour
  std::vector<KnownCells> open;  // of none, evenly spread over each picture
};

torch::Tensor PickRows(const torch::Tensor& rows, int64_t wanted) {
  const int64_t count = rows.size(0);
  if (count <= wanted) return rows;
  return rows.index_select(0, (torch::arange(wanted, torch::kInt64) * count).floor_divide(wanted));
}

// `key`: cells of the key view. Adds the variation of features of one place between pictures to
// `view_noise`.
AdditionalCells FindAdditionalCells(const TapEncoder& encoder,
                                    std::span<const TrainingPicture> pictures,
                                    const KnownCells& key,
                                    const FeatureNeighborsOptions& options,
                                    Random& random,
                                    const CancellationToken& cancel,
                                    ThreadPool* helpers,
                                    ViewNoise* view_noise) {
  AdditionalCells found;
  const auto further = static_cast<int64_t>(pictures.size()) - 1;
  const auto placed = [](const KnownCells& cells) {
    return PlacedCells{cells.blocks, cells.positions};
  };
  KnownCells previous;
  const auto describe = [&](int64_t i) {
    cancel.ThrowIfCancelled();
    torch::NoGradGuard no_grad;
    SetTorchThreads(1);
    return ComputeKnownCells(
        encoder, pictures[static_cast<size_t>(i) + 1], options.relative_chroma);
  };
  ForOrdered(helpers, further, describe, [&](int64_t, KnownCells cells) {
    view_noise->Add(placed(key), placed(cells), random);
    if (!found.sure.empty()) view_noise->Add(placed(previous), placed(cells), random);
    const torch::Tensor is_sure = cells.weights > options.min_weight;
    const torch::Tensor sure = is_sure.nonzero().squeeze(1);
    const torch::Tensor rows =
        sure.index_select(0, SampleRows(sure.size(0), options.further_bank_size / further, random));
    found.sure.push_back(Select(cells, rows));
    found.open.push_back(
        Select(cells, PickRows(is_sure.logical_not().nonzero().squeeze(1), kOpenCells)));
    previous = std::move(cells);
  });
  return found;
}

NamedTensors ListTensors(const std::vector<Whitening::Projection>& projections) {
  NamedTensors tensors;
  for (size_t i = 0; i < projections.size(); ++i) {
    tensors.emplace_back(fmt::format("mean.{}", i), projections[i].mean);
    tensors.emplace_back(fmt::format("matrix.{}", i), projections[i].matrix);
  }
  return tensors;
}

NamedTensors ListTensors(const CellBank& bank) {
  return {{"bank", bank.features},
          {"colors", bank.colors},
          {"weights", bank.weights},
          {"positions", bank.positions}};
}

}  // namespace

FeatureNeighbors::FeatureNeighbors(const TapEncoder& encoder,
                                   std::span<const TrainingPicture> pictures,
                                   const FeatureNeighborsOptions& options,
                                   Random random,
                                   const CancellationToken& cancel,
                                   ThreadPool* helpers)
    : FeatureNeighbors(encoder, options, Whitening(std::vector<Whitening::Projection>()), {}) {
  torch::NoGradGuard no_grad;
  const KnownCells key = ComputeKnownCells(encoder, pictures.front(), options.relative_chroma);
  // Cells without a colour would make similar places grey.
  torch::Tensor colored = (key.weights > 0.0).nonzero().squeeze(1);
  if (colored.size(0) == 0) colored = torch::arange(key.weights.size(0));
  const KnownCells of_key =
      Select(key, colored.index_select(0, SampleRows(colored.size(0), options.bank_size, random)));
  ViewNoise view_noise;
  AdditionalCells found =
      FindAdditionalCells(encoder, pictures, key, options, random, cancel, helpers, &view_noise);
  std::vector<KnownCells> parts = std::move(found.sure);
  parts.insert(parts.begin(), of_key);
  whitening_ = Whitening(
      key.blocks, encoder.config().stem_stride, options.whitening, view_noise.Covariances());
  const KnownCells all = Join(parts);
  // Rounded to half precision here, so that a colorizer read from its file predicts the same.
  const auto stored = [](const torch::Tensor& exact) {
    return exact.to(torch::kHalf).to(torch::kFloat32).contiguous();
  };
  bank_ = {stored(whitening_.Apply(all.blocks)),
           stored(all.colors),
           stored(all.weights),
           stored(all.positions)};
  if (found.open.empty()) return;
  const KnownCells open = Join(found.open);
  if (open.weights.size(0) == 0) return;
  open_variance_ =
      MatchCells({whitening_.Apply(open.blocks), open.positions}, bank_, options.vote, cancel)
          .variance;
}

FeatureNeighbors::FeatureNeighbors(const TapEncoder& encoder,
                                   const FeatureNeighborsOptions& options,
                                   Whitening whitening,
                                   CellBank bank)
    : encoder_(encoder.config()),
      options_(options),
      whitening_(std::move(whitening)),
      bank_(std::move(bank)) {}

void FeatureNeighbors::PutInto(TensorFile* file) const {
  PutTensors(ListTensors(whitening_.projections()), kPrefix, StoredType::kFloat32, file);
  PutTensors(ListTensors(bank_), kPrefix, StoredType::kFloat16, file);
}

void FeatureNeighbors::ForgetPositions(TensorFile* file) {
  const auto positions = file->arrays.find(std::string(kPrefix) + "positions");
  if (positions != file->arrays.end()) std::ranges::fill(positions->second.values, 0.0f);
}

std::unique_ptr<FeatureNeighbors> FeatureNeighbors::TakeFrom(const TapEncoder& encoder,
                                                             const FeatureNeighborsOptions& options,
                                                             const std::string& what,
                                                             TensorFile* file) {
  // All shapes follow from the encoder but the number of bank entries.
  std::vector<Whitening::Projection> projections;
  for (int i = 0; i <= encoder.config().StageCount(); ++i) {
    const int64_t in =
        i < encoder.config().StageCount() ? encoder.config().dims[i] : kLuminanceStatistics;
    const int64_t out = std::min<int64_t>(options.whitening.dims_per_block, in);
    projections.push_back({torch::empty({in}), torch::empty({in, out})});
  }
  TakeTensors(ListTensors(projections), kPrefix, what, file);
  Whitening whitening(std::move(projections));
  const auto colors = file->arrays.find(std::string(kPrefix) + "colors");
  if (colors == file->arrays.end() || colors->second.shape.empty() || colors->second.shape[0] < 1) {
    throw InvalidArgument("{} has no colours of the feature neighbors", what);
  }
  const int64_t entries = colors->second.shape[0];
  CellBank bank{torch::empty({entries, whitening.Columns()}),
                torch::empty({entries, 2}),
                torch::empty({entries}),
                torch::empty({entries, 4})};
  TakeTensors(ListTensors(bank), kPrefix, what, file);
  return std::unique_ptr<FeatureNeighbors>(
      new FeatureNeighbors(encoder, options, std::move(whitening), std::move(bank)));
}

NeighborColors FeatureNeighbors::Lookup(const std::vector<torch::Tensor>& taps,
                                        const torch::Tensor& luminance,
                                        const torch::Tensor& wanted,
                                        const Image& position) const {
  torch::NoGradGuard no_grad;
  const CellFeatures cells = DescribeCells(encoder_, taps, luminance);
  const int64_t height = cells.rows, width = cells.columns;
  CellQueries queries{whitening_.Apply(cells.blocks), {}};
  if (!position.Empty()) {
    queries.positions = CellPositions(position, cells.Count());
  }
  torch::Tensor rows;
  if (wanted.defined()) {
    rows = wanted.flatten().nonzero().squeeze(1);
    queries.features = queries.features.index_select(0, rows);
    if (!position.Empty()) queries.positions = queries.positions.index_select(0, rows);
  }
  torch::Tensor ab = torch::zeros({height * width, 2});
  torch::Tensor distance = torch::zeros({height * width});
  torch::Tensor variance = torch::zeros({height * width});
  if (queries.features.size(0) > 0) {
    const CellMatches matches = MatchCells(queries, bank_, options_.vote);
    ab = rows.defined() ? ab.index_copy(0, rows, matches.ab) : matches.ab;
    distance = rows.defined() ? distance.index_copy(0, rows, matches.distance) : matches.distance;
    variance = rows.defined() ? variance.index_copy(0, rows, matches.variance) : matches.variance;
  }
  return {ab.t().reshape({2, height, width}),
          distance.reshape({height, width}),
          variance.reshape({height, width})};
}

}  // namespace color3d
