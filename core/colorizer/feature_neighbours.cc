#include "core/colorizer/feature_neighbours.h"

#include <ATen/Parallel.h>
#include <torch/torch.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/base/error.h"
#include "core/colorizer/padding.h"
#include "core/colorizer/tensor_archive.h"
#include "core/encoder/image_tensors.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr int64_t kQueriesAtOnce = 128;  // distances to the whole bank stay in the cache
constexpr float kNegligible = 16.0f;     // exp(-16) of the best match's weight
// Local means and deviations of L: windows in cells of the answer grid.
constexpr int kWindows[] = {1, 3, 9};
constexpr int64_t kStatisticsChannels = 7;  // L, and mean and deviation per window
constexpr double kEigenvalueFloor = 0.02;   // share of the largest eigenvalue

// Mean over a (2 radius + 1)^2 window, clipped at the borders.
torch::Tensor WindowMean(const torch::Tensor& x, int radius) {
  return torch::avg_pool2d(x,
                           {2 * radius + 1, 2 * radius + 1},
                           {1, 1},
                           {radius, radius},
                           /*ceil_mode=*/false,
                           /*count_include_pad=*/false);
}

// [1,K,h,w]: local statistics of L, which normalised encoder features have lost.
torch::Tensor LuminanceStatistics(const torch::Tensor& luminance, int stride) {
  const torch::Tensor l = torch::avg_pool2d(luminance / 100.0, {stride, stride});
  const torch::Tensor ll = torch::avg_pool2d((luminance / 100.0).square(), {stride, stride});
  std::vector<torch::Tensor> maps{l};
  for (int radius : kWindows) {
    const torch::Tensor mean = WindowMean(l, radius);
    const torch::Tensor variance = (WindowMean(ll, radius) - mean.square()).clamp_min(0.0);
    maps.push_back(mean);
    maps.push_back((variance + 1e-5).sqrt());
  }
  return torch::cat(maps, 1);
}

// Brings a tap to the answer grid: [cells, channels].
torch::Tensor OnGrid(const torch::Tensor& tap, int64_t height, int64_t width) {
  torch::Tensor x = tap;
  if (x.size(2) > height) {
    const int64_t factor = x.size(2) / height;
    x = torch::avg_pool2d(x, {factor, factor});
  } else if (x.size(2) < height) {
    x = torch::upsample_bilinear2d(x, {height, width}, /*align_corners=*/false);
  }
  return x[0].flatten(1).t();
}

struct Projection {
  torch::Tensor mean;    // [C]
  torch::Tensor matrix;  // [C, D]: standardise, rotate, whiten
};

// Whitening to the leading principal components, in float64. `weight` scales the block so that each
// kind of feature takes the share of the distance that it is given.
Projection Whiten(const torch::Tensor& samples, int64_t dims, double weight) {
  const torch::Tensor x = samples.to(torch::kFloat64);
  const torch::Tensor mean = x.mean(0);
  const torch::Tensor inverse_deviation = (x.var(0, /*unbiased=*/false) + 1e-8).rsqrt();
  const torch::Tensor standardised = (x - mean) * inverse_deviation;
  const torch::Tensor covariance =
      torch::mm(standardised.t(), standardised) / static_cast<double>(x.size(0));
  torch::Tensor values, vectors;
  std::tie(values, vectors) = torch::linalg_eigh(covariance);  // ascending
  dims = std::min<int64_t>(dims, x.size(1));
  values = values.slice(0, x.size(1) - dims);
  vectors = vectors.slice(1, x.size(1) - dims);
  const torch::Tensor floor = values.max() * kEigenvalueFloor;
  const torch::Tensor scale =
      weight / static_cast<double>(dims) / (values.clamp_min(0.0) + floor + 1e-12);
  Projection projection;
  projection.mean = mean.to(torch::kFloat32);
  projection.matrix = (inverse_deviation.unsqueeze(1) * vectors * scale.sqrt()).to(torch::kFloat32);
  return projection;
}

double TapWeight(const FeatureNeighboursOptions& options, int stride_px) {
  size_t octave = 0;
  while (octave + 1 < options.tap_weights.size() && (4 << octave) <= stride_px) ++octave;
  return options.tap_weights[octave];
}

torch::Tensor SampleRows(int64_t count, int64_t wanted, Random& random) {
  std::vector<int64_t> rows(count);
  std::iota(rows.begin(), rows.end(), int64_t{0});
  const int64_t taken = std::min(count, wanted);
  for (int64_t i = 0; i < taken; ++i) {
    std::swap(rows[i], rows[i + random.NextBelow(static_cast<uint32_t>(count - i))]);
  }
  return torch::tensor(std::vector<int64_t>(rows.begin(), rows.begin() + taken), torch::kInt64);
}

// Raw features of a picture's cells: one block per tap, then L statistics: [cells, channels] each.
std::vector<torch::Tensor> RawBlocks(const std::vector<torch::Tensor>& taps,
                                     const torch::Tensor& luminance,
                                     int stride) {
  const int64_t height = luminance.size(2) / stride;
  const int64_t width = luminance.size(3) / stride;
  std::vector<torch::Tensor> blocks;
  for (const torch::Tensor& tap : taps) blocks.push_back(OnGrid(tap, height, width));
  blocks.push_back(OnGrid(LuminanceStatistics(luminance, stride), height, width));
  return blocks;
}

// Height of every cell in the picture, unit variance over the picture times sqrt(weight):
// [cells,1].
torch::Tensor VerticalPosition(const torch::Tensor& luminance,
                               int stride,
                               int picture_height,
                               double weight) {
  const int64_t height = luminance.size(2) / stride;
  const int64_t width = luminance.size(3) / stride;
  const torch::Tensor y = (torch::arange(height, torch::kFloat32) + 0.5) * stride / picture_height;
  return (y * std::sqrt(12.0 * weight)).unsqueeze(1).expand({height, width}).reshape({-1, 1});
}

// Appends the cells of a picture, resized.
void AddCells(const TapEncoder& encoder,
              const TrainingPicture& picture,
              double scale,
              const FeatureNeighboursOptions& options,
              FeatureNeighbours::Cells* cells) {
  const int multiple = encoder.config().Stride(encoder.config().StageCount() - 1);
  const int width = std::max(1, static_cast<int>(std::lround(picture.luminance.width * scale)));
  const int height = std::max(1, static_cast<int>(std::lround(picture.luminance.height * scale)));
  const auto prepared = [&](const Image& image) {
    return PadToMultiple(TensorFromImage(Resize(image, width, height)), multiple);
  };
  const auto per_cell = [&](const torch::Tensor& x) {
    return torch::avg_pool2d(x, {options.stride, options.stride})[0].flatten(1).t();
  };
  const torch::Tensor l = prepared(picture.luminance);
  std::vector<torch::Tensor> blocks = RawBlocks(encoder.Taps(encoder.Input(l)), l, options.stride);
  const int64_t count = blocks[0].size(0);
  if (cells->blocks.empty()) {
    cells->blocks = std::move(blocks);
  } else {
    for (size_t i = 0; i < blocks.size(); ++i) {
      cells->blocks[i] = torch::cat({cells->blocks[i], blocks[i]});
    }
  }
  const auto append = [](torch::Tensor& to, const torch::Tensor& more) {
    to = to.defined() ? torch::cat({to, more}) : more;
  };
  append(cells->positions, VerticalPosition(l, options.stride, height, options.position_weight));
  append(cells->colors, per_cell(prepared(picture.ab)));
  append(cells->weights,
         picture.weight.Empty() ? torch::ones({count})
                                : per_cell(prepared(picture.weight)).squeeze(1).contiguous());
}

FeatureNeighbours::Cells Select(const FeatureNeighbours::Cells& cells, const torch::Tensor& rows) {
  FeatureNeighbours::Cells out;
  for (const torch::Tensor& block : cells.blocks) {
    out.blocks.push_back(block.index_select(0, rows));
  }
  out.positions = cells.positions.index_select(0, rows);
  out.colors = cells.colors.index_select(0, rows);
  out.weights = cells.weights.index_select(0, rows);
  return out;
}

}  // namespace

FeatureNeighbours::FeatureNeighbours(const TapEncoder& encoder,
                                     std::span<const TrainingPicture> pictures,
                                     const FeatureNeighboursOptions& options,
                                     Random random,
                                     const CancellationToken& cancel)
    : options_(options) {
  torch::NoGradGuard no_grad;
  Cells key;
  for (double scale : options.scales) {
    cancel.ThrowIfCancelled();
    AddCells(encoder, pictures.front(), scale, options, &key);
  }
  const Cells chosen = Select(key, SampleRows(key.Count(), options.bank_size, random));
  for (size_t i = 0; i < chosen.blocks.size(); ++i) {
    const bool is_tap = i + 1 < chosen.blocks.size();
    const double weight = is_tap ? TapWeight(options, encoder.config().Stride(static_cast<int>(i)))
                                 : options.luminance_weight;
    const Projection projection = Whiten(chosen.blocks[i], options.dims_per_tap, weight);
    state_["mean." + std::to_string(i)] = projection.mean;
    state_["matrix." + std::to_string(i)] = projection.matrix;
  }
  std::vector<torch::Tensor> bank{Project(chosen)}, colors{chosen.colors}, weights{chosen.weights};
  const auto further = static_cast<int64_t>(pictures.size()) - 1;
  for (int64_t i = 1; i <= further; ++i) {
    cancel.ThrowIfCancelled();
    Cells cells;
    AddCells(encoder, pictures[i], 1.0, options, &cells);
    const torch::Tensor sure = (cells.weights > options.least_weight).nonzero().squeeze(1);
    if (sure.size(0) == 0) continue;
    const torch::Tensor rows =
        sure.index_select(0, SampleRows(sure.size(0), options.further_bank_size / further, random));
    const Cells taken = Select(cells, rows);
    bank.push_back(Project(taken));
    colors.push_back(taken.colors);
    weights.push_back(taken.weights);
  }
  // Rounded to half precision here, so that a colorizer read from its file answers the same.
  const auto stored = [](const std::vector<torch::Tensor>& parts) {
    return torch::cat(parts).to(torch::kHalf).to(torch::kFloat32).contiguous();
  };
  state_["bank"] = stored(bank);
  state_["colors"] = stored(colors);
  state_["weights"] = stored(weights);
}

torch::Tensor FeatureNeighbours::Project(const Cells& cells) const {
  std::vector<torch::Tensor> parts;
  for (size_t i = 0; i < cells.blocks.size(); ++i) {
    const std::string index = std::to_string(i);
    parts.push_back(
        torch::mm(cells.blocks[i] - state_.at("mean." + index), state_.at("matrix." + index)));
  }
  parts.push_back(cells.positions);
  return torch::cat(parts, 1);
}

FeatureNeighbours::FeatureNeighbours(const FeatureNeighboursOptions& options,
                                     std::map<std::string, torch::Tensor> state)
    : options_(options), state_(std::move(state)) {}

std::unique_ptr<FeatureNeighbours> FeatureNeighbours::FromArchive(
    const TapEncoder& encoder,
    const FeatureNeighboursOptions& options,
    const std::string& what,
    Archive& archive) {
  // Shapes that follow from the encoder; only the number of bank entries is the file's own.
  std::map<std::string, std::vector<int64_t>> shapes;
  int64_t columns = 1;  // vertical position
  for (int i = 0; i <= encoder.config().StageCount(); ++i) {
    const int64_t in =
        i < encoder.config().StageCount() ? encoder.config().dims[i] : kStatisticsChannels;
    const int64_t out = std::min<int64_t>(options.dims_per_tap, in);
    shapes["mean." + std::to_string(i)] = {in};
    shapes["matrix." + std::to_string(i)] = {in, out};
    columns += out;
  }
  const auto colors = archive.arrays.find("neighbours.colors");
  if (colors == archive.arrays.end() || colors->second.shape.empty() ||
      colors->second.shape[0] < 1) {
    throw InvalidArgument(what + " lacks the colours of the feature neighbours");
  }
  const int64_t entries = colors->second.shape[0];
  shapes["colors"] = {entries, 2};
  shapes["bank"] = {entries, columns};
  shapes["weights"] = {entries};
  std::map<std::string, torch::Tensor> state;
  NamedTensors tensors;
  for (const auto& [name, shape] : shapes) {
    state[name] = torch::empty(shape, torch::kFloat32);
    tensors.emplace_back(name, state[name]);
  }
  TakeTensors(tensors, "neighbours.", what, archive);
  return std::make_unique<FeatureNeighbours>(options, std::move(state));
}

torch::Tensor FeatureNeighbours::Features(const std::vector<torch::Tensor>& taps,
                                          const torch::Tensor& luminance,
                                          int picture_height) const {
  Cells cells;
  cells.blocks = RawBlocks(taps, luminance, options_.stride);
  cells.positions =
      VerticalPosition(luminance, options_.stride, picture_height, options_.position_weight);
  return Project(cells);
}

FeatureNeighbours::Matches FeatureNeighbours::LookupFeatures(const torch::Tensor& queries) const {
  torch::NoGradGuard no_grad;
  const torch::Tensor& bank = state_.at("bank");
  const int64_t entries = bank.size(0);
  const torch::Tensor transposed = bank.t();
  const torch::Tensor bank_squares = bank.square().sum(1);
  const float* colors = state_.at("colors").data_ptr<float>();
  const float* weights = state_.at("weights").data_ptr<float>();
  Matches matches{torch::empty({queries.size(0), 2}),
                  torch::empty({queries.size(0)}),
                  torch::empty({queries.size(0)})};
  for (int64_t begin = 0; begin < queries.size(0); begin += kQueriesAtOnce) {
    const int64_t end = std::min(begin + kQueriesAtOnce, queries.size(0));
    const torch::Tensor q = queries.slice(0, begin, end);
    const torch::Tensor q_squares = q.square().sum(1).contiguous();
    // |q - b|^2 without |q|^2, which is the same for all b.
    const torch::Tensor d = torch::addmm(bank_squares, q, transposed, /*beta=*/1.0, /*alpha=*/-2.0);
    const torch::Tensor least = d.amin(1);
    const float* distances = d.data_ptr<float>();
    const float* smallest = least.data_ptr<float>();
    const float* squares = q_squares.data_ptr<float>();
    float* ab = matches.ab.data_ptr<float>() + 2 * begin;
    float* nearest = matches.distance.data_ptr<float>() + begin;
    float* variance = matches.variance.data_ptr<float>() + begin;
    at::parallel_for(0, end - begin, /*grain_size=*/16, [&](int64_t first, int64_t last) {
      for (int64_t i = first; i < last; ++i) {
        const float* row = distances + i * entries;
        const float best = smallest[i];
        nearest[i] = std::max(best + squares[i], 0.0f);
        const auto inverse_width = static_cast<float>(
            1.0 / (options_.temperature * (nearest[i] + options_.distance_floor)));
        const float farthest = best + kNegligible / inverse_width;
        double sum = 0.0, a = 0.0, b = 0.0, squares_of_ab = 0.0;
        for (int64_t j = 0; j < entries; ++j) {
          if (row[j] > farthest) continue;
          const double w = weights[j] * std::exp((best - row[j]) * inverse_width);
          sum += w;
          const double ca = colors[2 * j], cb = colors[2 * j + 1];
          a += w * ca;
          b += w * cb;
          squares_of_ab += w * (ca * ca + cb * cb);
        }
        // Where nothing has weight nothing is known: grey.
        const double scale = sum > 0.0 ? 1.0 / sum : 0.0;
        a *= scale;
        b *= scale;
        ab[2 * i] = static_cast<float>(a);
        ab[2 * i + 1] = static_cast<float>(b);
        variance[i] = static_cast<float>(std::max(squares_of_ab * scale - a * a - b * b, 0.0));
      }
    });
  }
  return matches;
}

NeighbourColors FeatureNeighbours::Lookup(const std::vector<torch::Tensor>& taps,
                                          const torch::Tensor& luminance,
                                          int picture_height,
                                          const torch::Tensor& wanted) const {
  torch::NoGradGuard no_grad;
  const int64_t height = luminance.size(2) / options_.stride;
  const int64_t width = luminance.size(3) / options_.stride;
  torch::Tensor queries = Features(taps, luminance, picture_height);
  torch::Tensor rows;
  if (wanted.defined()) {
    rows = wanted.flatten().nonzero().squeeze(1);
    queries = queries.index_select(0, rows);
  }
  torch::Tensor ab = torch::zeros({height * width, 2});
  torch::Tensor distance = torch::zeros({height * width});
  torch::Tensor variance = torch::zeros({height * width});
  if (queries.size(0) > 0) {
    const Matches matches = LookupFeatures(queries);
    ab = rows.defined() ? ab.index_copy(0, rows, matches.ab) : matches.ab;
    distance = rows.defined() ? distance.index_copy(0, rows, matches.distance) : matches.distance;
    variance = rows.defined() ? variance.index_copy(0, rows, matches.variance) : matches.variance;
  }
  return {ab.t().reshape({2, height, width}),
          distance.reshape({height, width}),
          variance.reshape({height, width})};
}

}  // namespace color3d
