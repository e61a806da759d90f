#include "core/metrics/confidence_interval.h"

#include <algorithm>
#include <cstddef>
#include <random>

namespace color3d {
namespace {

constexpr int kBootstrapSamples = 2000;

}  // namespace

MeanWithInterval BootstrapMean(const std::vector<double>& values) {
  const size_t count = values.size();
  const auto mean_of = [count](auto&& value) {
    double sum = 0.0;
    for (size_t i = 0; i < count; ++i) sum += value(i);
    return sum / static_cast<double>(count);
  };
  std::mt19937 random(1);
  std::vector<double> means(kBootstrapSamples);
  for (double& mean : means) {
    mean = mean_of([&](size_t) { return values[random() % count]; });
  }
  std::sort(means.begin(), means.end());
  return {mean_of([&](size_t i) { return values[i]; }),
          means[static_cast<size_t>(0.025 * kBootstrapSamples)],
          means[static_cast<size_t>(0.975 * kBootstrapSamples) - 1]};
}

}  // namespace color3d
