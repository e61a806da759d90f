#include "core/matching/cell_matches.h"

#include <ATen/Parallel.h>
#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace color3d {
namespace {

constexpr int64_t kQueriesAtOnce = 128;  // distances to the whole bank stay in the cache
constexpr float kNegligible = 16.0f;     // exp(-16) of the best match's weight

// |x - y|^2 without |x|^2, which is the same for all y.
torch::Tensor RelativeDistances(const torch::Tensor& x,
                                const torch::Tensor& transposed_y,
                                const torch::Tensor& y_squares) {
  return torch::addmm(y_squares, x, transposed_y, /*beta=*/1.0, /*alpha=*/-2.0);
}

constexpr double kMedianSoftness = 0.5;  // Lab units: nearer voters than this count as one
// Voters are gathered by color first, so that their median costs little more than their mean.
constexpr float kBinSide = 3.0f;  // Lab units
constexpr int kBins = 128;        // a side; what lies beyond is gathered in the outermost

// The colours of a query's matches, weighted.
class Vote {
 public:
  Vote(const float* colors, const float* weights)
      : colors_(colors), weights_(weights), bins_(kBins * kBins) {}

  void Clear() {
    for (int bin : filled_) bins_[bin] = {};
    filled_.clear();
    squares_ = 0.0;
  }
  void Add(int64_t row, float closeness) {
    const float w = weights_[row] * closeness;
    if (!(w > 0.0f)) return;
    const float a = colors_[2 * row], b = colors_[2 * row + 1];
    const int index = Place(a) * kBins + Place(b);
    Bin& bin = bins_[index];
    if (bin.weight == 0.0) filled_.push_back(index);
    bin.weight += w;
    bin.a += static_cast<double>(w) * a;
    bin.b += static_cast<double>(w) * b;
    squares_ += w * (static_cast<double>(a) * a + static_cast<double>(b) * b);
  }
  void Store(int median_steps, float* ab, float* variance) {
    double sum = 0.0, a = 0.0, b = 0.0;
    for (int index : filled_) {
      Bin& bin = bins_[index];
      sum += bin.weight;
      a += bin.a;
      b += bin.b;
      bin.a /= bin.weight;
      bin.b /= bin.weight;
    }
    // Where nothing has weight nothing is known: grey.
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

  static int Place(float value) {
    return std::clamp(static_cast<int>(value / kBinSide + 0.5f * kBins), 0, kBins - 1);
  }

  // Weiszfeld 1937: the mean under weight / distance from where it was.
  void WeiszfeldStep(double* a, double* b) const {
    double sum = 0.0, next_a = 0.0, next_b = 0.0;
    for (int index : filled_) {
      const Bin& bin = bins_[index];
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
  std::vector<Bin> bins_;
  std::vector<int> filled_;
  double squares_ = 0.0;
};

// Rows of the `count` smallest of `distances`, ascending; of equal ones the first.
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

CellMatches MatchCells(const torch::Tensor& queries,
                       const CellBank& bank,
                       const VoteOptions& options,
                       const CancellationToken& cancel,
                       bool with_bank_distance) {
  const int64_t count = queries.size(0), entries = bank.features.size(0);
  const torch::Tensor transposed = bank.features.t();
  const torch::Tensor bank_squares = bank.features.square().sum(1);
  const float* colors = bank.colors.data_ptr<float>();
  const float* weights = bank.weights.data_ptr<float>();
  CellMatches matches{torch::empty({count, 2}),
                      torch::empty({count}),
                      torch::empty({count}),
                      torch::empty({count}, torch::kInt64),
                      {}};
  for (int64_t begin = 0; begin < count; begin += kQueriesAtOnce) {
    cancel.ThrowIfCancelled();
    const int64_t end = std::min(begin + kQueriesAtOnce, count);
    const torch::Tensor q = queries.slice(0, begin, end);
    const torch::Tensor q_squares = q.square().sum(1).contiguous();
    const torch::Tensor d = RelativeDistances(q, transposed, bank_squares);
    const torch::Tensor smallest = d.amin(1);
    if (with_bank_distance) {
      const torch::Tensor to_bank = (d + q_squares.unsqueeze(1)).amin(0).clamp_min(0.0);
      matches.bank_distance = matches.bank_distance.defined()
                                  ? torch::minimum(matches.bank_distance, to_bank)
                                  : to_bank;
    }
    const float* distances = d.data_ptr<float>();
    const float* best_of_query = smallest.data_ptr<float>();
    const float* squares = q_squares.data_ptr<float>();
    float* ab = matches.ab.data_ptr<float>() + 2 * begin;
    float* distance = matches.distance.data_ptr<float>() + begin;
    float* variance = matches.variance.data_ptr<float>() + begin;
    int64_t* nearest = matches.nearest.data_ptr<int64_t>() + begin;
    at::parallel_for(0, end - begin, /*grain_size=*/32, [&](int64_t first, int64_t last) {
      std::vector<std::pair<float, int64_t>> voters;
      Vote vote(colors, weights);
      for (int64_t i = first; i < last; ++i) {
        const float* row = distances + i * entries;
        const float best = best_of_query[i];
        distance[i] = std::max(best + squares[i], 0.0f);
        const auto inverse_width = static_cast<float>(
            1.0 / (options.temperature * (distance[i] + options.distance_floor)));
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
          for (int64_t j = 0; j < entries; ++j) add(j);
        }
        if (nearest[i] == entries) nearest[i] = 0;  // features that are no numbers
        vote.Store(options.median_steps, ab + 2 * i, variance + i);
      }
    });
  }
  return matches;
}

}  // namespace color3d
