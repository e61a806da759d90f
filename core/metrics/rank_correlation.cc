#include "core/metrics/rank_correlation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

// From 1; ties get the mean.
std::vector<double> Ranks(const std::vector<float>& values) {
  for (const float v : values) {
    if (!std::isfinite(v)) throw InvalidArgument("a value to rank is {}", v);
  }
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t i, size_t j) {
    return values[i] != values[j] ? values[i] < values[j] : i < j;
  });
  std::vector<double> ranks(values.size());
  for (size_t begin = 0; begin < order.size();) {
    size_t end = begin;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double mean = 0.5 * static_cast<double>(begin + 1 + end);
    for (size_t k = begin; k < end; ++k) ranks[order[k]] = mean;
    begin = end;
  }
  return ranks;
}

}  // namespace

double RankCorrelation(const std::vector<float>& x, const std::vector<float>& y) {
  if (x.size() != y.size()) {
    throw InvalidArgument("lists of {} and {} values cannot be correlated", x.size(), y.size());
  }
  if (x.size() < 2) return 0.0;
  const std::vector<double> p = Ranks(x), q = Ranks(y);
  const double mean = 0.5 * static_cast<double>(x.size() + 1);
  double pq = 0.0, pp = 0.0, qq = 0.0;
  for (size_t i = 0; i < p.size(); ++i) {
    pq += (p[i] - mean) * (q[i] - mean);
    pp += (p[i] - mean) * (p[i] - mean);
    qq += (q[i] - mean) * (q[i] - mean);
  }
  return pp > 0.0 && qq > 0.0 ? pq / std::sqrt(pp * qq) : 0.0;
}

}  // namespace color3d
