#include "core/matching/cell_matches.h"

#include <ATen/Parallel.h>
#include <torch/types.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace color3d {
namespace {

constexpr int64_t kQueriesAtOnce = 64;  // distances to the whole bank stay in the cache
constexpr float kNegligible = 8.0f;     // exp(-8) of the best match's weight

constexpr int64_t kStep = 16;  // entries that are tested together

float Smallest(const float* values, int64_t count) {
  if (count == kStep) {
    return Eigen::Map<const Eigen::Array<float, kStep, 1>>(values).minCoeff();  // vectorized
  }
  return *std::min_element(values, values + count);
}

// |x - y|^2 without |x|^2, which is the same for all y.
torch::Tensor RelativeDistances(const torch::Tensor& x,
                                const torch::Tensor& transposed_y,
                                const torch::Tensor& y_squares) {
  return torch::addmm(y_squares, x, transposed_y, /*beta=*/1.0, /*alpha=*/-2.0);
}

constexpr double kMedianSoftness = 0.5;  // Lab units; bounds the weight of voters at the median
// Voters are binned by colour, so that their median costs little more than their mean.
constexpr float kBinSide = 3.0f;  // Lab units
constexpr int kBins = 128;        // per side; the outermost bins hold all colours beyond

// Bins of the entries of a bank by colour.
struct ColorBins {
  std::vector<int32_t> of_entry;
  int32_t count = 0;  // number of bins with entries

  explicit ColorBins(const torch::Tensor& colors) {
    const float* ab = colors.data_ptr<float>();
    const auto place = [](float value) {
      return std::clamp(static_cast<int>(value / kBinSide + 0.5f * kBins), 0, kBins - 1);
    };
    std::vector<int32_t> numbers(kBins * kBins, -1);
    of_entry.reserve(colors.size(0));
    for (int64_t row = 0; row < colors.size(0); ++row) {
      int32_t& number = numbers[place(ab[2 * row]) * kBins + place(ab[2 * row + 1])];
      if (number < 0) number = count++;
      of_entry.push_back(number);
    }
  }
};

// Weighted colours of the matches of a query.
class Vote {
 public:
  Vote(const CellBank& bank, const ColorBins& bins)
      : colors_(bank.colors.data_ptr<float>()),
        weights_(bank.weights.data_ptr<float>()),
        bin_of_(bins.of_entry.data()),
        bins_(bins.count) {}

  void Clear() {
    for (const int32_t number : used_) bins_[number] = {};
    used_.clear();
    squares_ = 0.0;
  }
  void Add(int64_t row, float closeness) {
    const double w = weights_[row] * closeness;
    if (!(w > 0.0)) return;
    const double a = colors_[2 * row], b = colors_[2 * row + 1];
    Bin& bin = bins_[bin_of_[row]];
    if (bin.weight == 0.0) used_.push_back(bin_of_[row]);
    bin.weight += w;
    bin.a += w * a;
    bin.b += w * b;
    squares_ += w * (a * a + b * b);
  }
  void Store(int median_steps, float* ab, float* variance) {
    double sum = 0.0, a = 0.0, b = 0.0;
    filled_.clear();
    for (const int32_t number : used_) {
      const Bin& bin = bins_[number];
      sum += bin.weight;
      a += bin.a;
      b += bin.b;
      filled_.push_back({bin.weight, bin.a / bin.weight, bin.b / bin.weight});
    }
    // Grey if no match has weight.
    const double scale = sum > 0.0 ? 1.0 / sum : 0.0;
    a *= scale;
    b *= scale;
    *variance = static_cast<float>(std::max(squares_ * scale - a * a - b * b, 0.0));
    for (int step = 0; step < median_steps && filled_.size() > 1; ++step) WeiszfeldStep(&a, &b);
    ab[0] = static_cast<float>(a);
    ab[1] = static_cast<float>(b);
  }

 private:
  struct Bin {
    double weight = 0.0, a = 0.0, b = 0.0;
  };

  // Weiszfeld 1937: mean weighted by weight / distance from the previous estimate.
  void WeiszfeldStep(double* a, double* b) const {
    double sum = 0.0, next_a = 0.0, next_b = 0.0;
    for (const Bin& bin : filled_) {
      const double da = bin.a - *a, db = bin.b - *b;
      const double w =
          bin.weight / std::sqrt(da * da + db * db + kMedianSoftness * kMedianSoftness);
      sum += w;
      next_a += w * bin.a;
      next_b += w * bin.b;
    }
    *a = next_a / sum;
    *b = next_b / sum;
  }

  const float* colors_;
  const float* weights_;
  const int32_t* bin_of_;
  std::vector<Bin> bins_;      // sums
  std::vector<int32_t> used_;  // indices of bins_ in use
  std::vector<Bin> filled_;    // means
  double squares_ = 0.0;
};

// Penalty of positions on the squared distances of features.
class PositionPenalty {
 public:
  PositionPenalty(const CellQueries& queries, const CellBank& bank, const VoteOptions& options)
      : weight_(static_cast<float>(options.position_weight)),
        inverse_reach_(static_cast<float>(1.0 / options.position_reach)) {
    if (!queries.positions.defined() || !bank.positions.defined() || !(weight_ > 0.0f)) return;
    if (!(bank.positions.select(1, 3).sum().item<float>() > 0.0f)) return;
    // Columns with products |x|^2 - 2 x y + |y|^2 if both are known, else the constant of an
    // unknown entry, else 0.
    const torch::Tensor x = queries.positions.slice(1, 0, 3) * queries.positions.slice(1, 3, 4);
    const torch::Tensor y = bank.positions.slice(1, 0, 3) * bank.positions.slice(1, 3, 4);
    const auto square = [](const torch::Tensor& v) { return v.square().sum(1, true); };
    queries_ = torch::cat({-2.0 * x, square(x), torch::ones_like(square(x))}, 1) *
               queries.positions.slice(1, 3, 4);
    const torch::Tensor known = bank.positions.slice(1, 3, 4);
    entries_ = torch::cat({y, known, square(y) + (1.0 - known) * kUnknownApart}, 1).t();
  }

  bool Counts() const { return queries_.defined(); }

  void AddTo(int64_t begin, int64_t end, torch::Tensor* distances) const {
    using Values = Eigen::Map<Eigen::ArrayXf>;
    const torch::Tensor squares = torch::mm(queries_.slice(0, begin, end), entries_);
    const int64_t entries = squares.size(1);
    at::parallel_for(0, end - begin, /*grain_size=*/16, [&](int64_t first, int64_t last) {
      const int64_t count = (last - first) * entries;
      const Values s(squares.data_ptr<float>() + first * entries, count);
      Values d(distances->data_ptr<float>() + first * entries, count);
      d += weight_ * s.max(0.0f) / (1.0f + inverse_reach_ * s.max(0.0f));
    });
  }

 private:
  static constexpr double kUnknownApart = 1.0;

  float weight_;
  float inverse_reach_;
  torch::Tensor queries_;  // [q,5]
  torch::Tensor entries_;  // [5,n]
};

// Rows of the `count` smallest `distances`, ascending; ties by row.
void NearestRows(const float* distances,
                 int64_t entries,
                 size_t count,
                 std::vector<std::pair<float, int64_t>>* nearest) {
  nearest->clear();
  for (int64_t row = 0; row < entries; ++row) {
    if (nearest->size() == count) {
      if (!(distances[row] < nearest->back().first)) continue;
      nearest->pop_back();
    }
    const std::pair<float, int64_t> entry{distances[row], row};
    nearest->insert(std::upper_bound(nearest->begin(), nearest->end(), entry), entry);
  }
}

}  // namespace

torch::Tensor SquaredDistances(const torch::Tensor& x, const torch::Tensor& y) {
  const torch::Tensor d = RelativeDistances(x, y.t(), y.square().sum(1));
  return (d + x.square().sum(1).unsqueeze(1)).clamp_min(0.0);
}

CellMatches MatchCells(const CellQueries& queries,
                       const CellBank& bank,
                       const VoteOptions& options,
                       const CancellationToken& cancel,
                       bool with_bank_distance) {
  const int64_t count = queries.features.size(0), entries = bank.features.size(0);
  const torch::Tensor transposed = bank.features.t();
  const torch::Tensor bank_squares = bank.features.square().sum(1);
  const PositionPenalty apartness(queries, bank, options);
  const ColorBins bins(bank.colors);
  CellMatches matches{torch::empty({count, 2}),
                      torch::empty({count}),
                      torch::empty({count}),
                      torch::empty({count}, torch::kInt64),
                      {}};
  for (int64_t begin = 0; begin < count; begin += kQueriesAtOnce) {
    cancel.ThrowIfCancelled();
    const int64_t end = std::min(begin + kQueriesAtOnce, count);
    const torch::Tensor q = queries.features.slice(0, begin, end);
    const torch::Tensor q_squares = q.square().sum(1).contiguous();
    torch::Tensor d = RelativeDistances(q, transposed, bank_squares);
    const torch::Tensor nearest_features = d.amin(1);
    torch::Tensor smallest = nearest_features;
    if (with_bank_distance) {
      const torch::Tensor to_bank = (d + q_squares.unsqueeze(1)).amin(0).clamp_min(0.0);
      matches.bank_distance = matches.bank_distance.defined()
                                  ? torch::minimum(matches.bank_distance, to_bank)
                                  : to_bank;
    }
    if (apartness.Counts()) {
      apartness.AddTo(begin, end, &d);
      smallest = d.amin(1);
    }
    const float* nearest_of_query = nearest_features.data_ptr<float>();
    const float* distances = d.data_ptr<float>();
    const float* best_of_query = smallest.data_ptr<float>();
    const float* squares = q_squares.data_ptr<float>();
    float* ab = matches.ab.data_ptr<float>() + 2 * begin;
    float* distance = matches.distance.data_ptr<float>() + begin;
    float* variance = matches.variance.data_ptr<float>() + begin;
    int64_t* nearest = matches.nearest.data_ptr<int64_t>() + begin;
    at::parallel_for(0, end - begin, /*grain_size=*/32, [&](int64_t first, int64_t last) {
      std::vector<std::pair<float, int64_t>> voters;
      Vote vote(bank, bins);
      for (int64_t i = first; i < last; ++i) {
        const float* row = distances + i * entries;
        const float best = best_of_query[i];
        distance[i] = std::max(nearest_of_query[i] + squares[i], 0.0f);
        const float apart = std::max(best + squares[i], 0.0f);
        const auto inverse_width =
            static_cast<float>(1.0 / (options.temperature * (apart + options.distance_floor)));
        const float farthest = best + kNegligible / inverse_width;
        vote.Clear();
        nearest[i] = entries;
        const auto add = [&](int64_t j) {
          if (row[j] > farthest) return;
          if (row[j] == best) nearest[i] = std::min(nearest[i], j);
          vote.Add(j, std::exp((best - row[j]) * inverse_width));
        };
        if (options.max_voters > 0) {
          NearestRows(row, entries, static_cast<size_t>(options.max_voters), &voters);
          for (const auto& [unused, j] : voters) add(j);
        } else {
          for (int64_t j = 0; j < entries; j += kStep) {
            const int64_t stop = std::min(j + kStep, entries);
            if (Smallest(row + j, stop - j) > farthest) continue;
            for (int64_t k = j; k < stop; ++k) add(k);
          }
        }
        if (nearest[i] == entries) nearest[i] = 0;  // all features are NaN
        vote.Store(options.median_steps, ab + 2 * i, variance + i);
      }
    });
  }
  return matches;
}

}  // namespace color3d
