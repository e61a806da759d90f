#include "core/splat/export/sog/codebook.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

namespace color3d {
namespace {

constexpr int kBins = 512;
constexpr int kLevelIterations = 200;
constexpr int kPaletteIterations = 8;

// Initial levels with the density of the cube root of the values' density, which is optimal for
// many levels.
void SpreadLevels(const std::vector<float>& sorted, std::span<float> levels) {
  const size_t count = levels.size();
  const double low = sorted.front(), width = (static_cast<double>(sorted.back()) - low) / kBins;
  std::vector<double> mass(kBins, 0.0);
  for (const float v : sorted) {
    mass[std::clamp(static_cast<int>((v - low) / width), 0, kBins - 1)] += 1.0;
  }
  double total = 0.0;
  for (double& m : mass) total += m = std::cbrt(m);
  double before = 0.0;
  size_t next = 0;
  for (int b = 0; b < kBins; ++b) {
    while (next < count && (next + 0.5) / count * total <= before + mass[b]) {
      const double within = ((next + 0.5) / count * total - before) / mass[b];
      levels[next++] = static_cast<float>(low + (b + within) * width);
    }
    before += mass[b];
  }
  while (next < count) levels[next++] = sorted.back();
}

// k-means of the rows with indices `members`.
class Clusters {
 public:
  Clusters(const std::vector<float>& rows, int width, std::vector<uint32_t> members, int count)
      : rows_(rows),
        width_(width),
        count_(count),
        members_(std::move(members)),
        labels_(members_.size(), 0),
        errors_(members_.size(), 0.0f),
        centers_(static_cast<size_t>(width) * count) {
    for (int c = 0; c < count; ++c) {  // spread evenly over the members
      const float* row = Row(static_cast<size_t>(c) * members_.size() / count);
      for (int k = 0; k < width; ++k) centers_[k * count_ + c] = row[k];
    }
  }

  void Assign(size_t begin, size_t end) {
    std::vector<float> distance(count_);
    for (size_t i = begin; i < end; ++i) {
      std::fill(distance.begin(), distance.end(), 0.0f);
      const float* row = Row(i);
      for (int k = 0; k < width_; ++k) {
        const float* center = centers_.data() + static_cast<size_t>(k) * count_;
        for (int c = 0; c < count_; ++c) {
          const float d = row[k] - center[c];
          distance[c] += d * d;
        }
      }
      const auto least = std::min_element(distance.begin(), distance.end());
      labels_[i] = static_cast<int>(least - distance.begin());
      errors_[i] = *least;
    }
  }

  // Each centre becomes the mean of its members; an empty cluster takes the row with the largest
  // error.
  void Update() {
    std::vector<double> sums(centers_.size(), 0.0);
    std::vector<int> counts(count_, 0);
    for (size_t i = 0; i < members_.size(); ++i) {
      const float* row = Row(i);
      ++counts[labels_[i]];
      for (int k = 0; k < width_; ++k) sums[k * count_ + labels_[i]] += row[k];
    }
    for (int c = 0; c < count_; ++c) {
      if (counts[c] > 0) {
        for (int k = 0; k < width_; ++k) {
          centers_[k * count_ + c] = static_cast<float>(sums[k * count_ + c] / counts[c]);
        }
        continue;
      }
      const size_t worst = std::max_element(errors_.begin(), errors_.end()) - errors_.begin();
      errors_[worst] = 0.0f;
      for (int k = 0; k < width_; ++k) centers_[k * count_ + c] = Row(worst)[k];
    }
  }

  int count() const { return count_; }
  const std::vector<uint32_t>& members() const { return members_; }
  int label(size_t i) const { return labels_[i]; }
  float error(size_t i) const { return errors_[i]; }
  float center(int c, int k) const { return centers_[k * count_ + c]; }

 private:
  const float* Row(size_t i) const {
    return rows_.data() + static_cast<size_t>(members_[i]) * width_;
  }

  const std::vector<float>& rows_;
  int width_;
  int count_;
  std::vector<uint32_t> members_;
  std::vector<int> labels_;
  std::vector<float> errors_;
  std::vector<float> centers_;  // width x count
};

// Distribution of `size` rows to the clusters in proportion to their error, at least one and at
// most the number of members each.
std::vector<int> Shares(const Clusters& coarse, int size) {
  std::vector<double> error(coarse.count(), 0.0);
  std::vector<int> members(coarse.count(), 0);
  for (size_t i = 0; i < coarse.members().size(); ++i) {
    error[coarse.label(i)] += coarse.error(i);
    ++members[coarse.label(i)];
  }
  const double total = std::accumulate(error.begin(), error.end(), 0.0);
  std::vector<int> shares(coarse.count(), 0);
  const int spare = size - coarse.count();
  for (int c = 0; c < coarse.count(); ++c) {
    const int wanted = 1 + (total > 0.0 ? static_cast<int>(spare * (error[c] / total)) : 0);
    shares[c] = std::min(wanted, members[c]);
  }
  return shares;
}

}  // namespace

Codebook::Codebook(std::vector<float> values, int count) {
  std::sort(values.begin(), values.end());
  std::vector<float> different;
  std::unique_copy(values.begin(), values.end(), std::back_inserter(different));
  if (!different.empty()) levels_.fill(different.back());
  if (different.size() <= static_cast<size_t>(count)) {
    std::copy(different.begin(), different.end(), levels_.begin());
  } else {
    const std::span<float> levels(levels_.data(), static_cast<size_t>(count));
    SpreadLevels(values, levels);
    std::vector<double> sums(values.size() + 1, 0.0);
    for (size_t i = 0; i < values.size(); ++i) sums[i + 1] = sums[i] + values[i];
    for (int iteration = 0; iteration < kLevelIterations; ++iteration) {
      size_t begin = 0;
      for (size_t level = 0; level < levels.size(); ++level) {
        size_t end = values.size();
        if (level + 1 < levels.size()) {
          const float bound = 0.5f * (levels[level] + levels[level + 1]);
          end = std::lower_bound(values.begin() + begin, values.end(), bound) - values.begin();
        }
        if (end > begin) {
          levels[level] =
              static_cast<float>((sums[end] - sums[begin]) / static_cast<double>(end - begin));
        }
        begin = end;
      }
    }
    std::sort(levels_.begin(), levels_.end());
  }
  for (size_t level = 0; level < bounds_.size(); ++level) {
    bounds_[level] = 0.5f * (levels_[level] + levels_[level + 1]);
  }
}

uint8_t Codebook::Nearest(float value) const {
  return static_cast<uint8_t>(std::lower_bound(bounds_.begin(), bounds_.end(), value) -
                              bounds_.begin());
}

Palette MakePalette(const std::vector<float>& rows, int width, int size, ThreadPool& pool) {
  Palette palette;
  palette.rows.assign(static_cast<size_t>(size) * width, 0.0f);
  const size_t count = rows.size() / width;
  palette.labels.assign(count, 0);
  if (count == 0) return palette;
  std::vector<uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0u);
  const int limit = static_cast<int>(std::min<size_t>(count, size));
  Clusters coarse(rows, width, all, std::max(1, static_cast<int>(std::sqrt(limit))));
  for (int iteration = 0; iteration <= kPaletteIterations; ++iteration) {
    if (iteration > 0) coarse.Update();
    pool.ForRanges(static_cast<int64_t>(count),
                   [&](int64_t begin, int64_t end, int) { coarse.Assign(begin, end); });
  }
  const std::vector<int> shares = Shares(coarse, limit);
  std::vector<std::vector<uint32_t>> members(coarse.count());
  for (size_t i = 0; i < count; ++i) {
    members[coarse.label(i)].push_back(static_cast<uint32_t>(i));
  }
  std::vector<int> first(coarse.count() + 1, 0);
  std::partial_sum(shares.begin(), shares.end(), first.begin() + 1);
  pool.ForEach(coarse.count(), [&](int64_t cell, int) {
    if (members[cell].empty()) return;
    Clusters fine(rows, width, std::move(members[cell]), shares[cell]);
    for (int iteration = 0; iteration <= kPaletteIterations; ++iteration) {
      if (iteration > 0) fine.Update();
      fine.Assign(0, fine.members().size());
    }
    for (int c = 0; c < fine.count(); ++c) {
      for (int k = 0; k < width; ++k) {
        palette.rows[(static_cast<size_t>(first[cell]) + c) * width + k] = fine.center(c, k);
      }
    }
    for (size_t i = 0; i < fine.members().size(); ++i) {
      palette.labels[fine.members()[i]] = static_cast<uint16_t>(first[cell] + fine.label(i));
    }
  });
  return palette;
}

}  // namespace color3d
