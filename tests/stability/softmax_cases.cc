// Softmaxes at temperatures from 1e-6 to 1e6: the entropy of the key view selection against long
// double.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/keyview/select.h"
#include "tests/stability/stability_case.h"

namespace color3d {
namespace {

using Descriptors = std::vector<std::vector<double>>;

Descriptors RandomDescriptors(double spread) {
  Random random(21);
  Descriptors descriptors(12, std::vector<double>(16));
  for (std::vector<double>& d : descriptors) {
    for (double& v : d) v = 1.0 + spread * random.NextNormal();
  }
  return descriptors;
}

// H_i = -sum_j P_ij log P_ij of the row softmax of the cosines over the temperature.
std::vector<long double> Entropies(const Descriptors& descriptors, long double temperature) {
  std::vector<long double> entropies;
  for (const std::vector<double>& x : descriptors) {
    std::vector<long double> logits;
    for (const std::vector<double>& y : descriptors) {
      long double xy = 0.0L, xx = 0.0L, yy = 0.0L;
      for (size_t k = 0; k < x.size(); ++k) {
        xy += static_cast<long double>(x[k]) * y[k];
        xx += static_cast<long double>(x[k]) * x[k];
        yy += static_cast<long double>(y[k]) * y[k];
      }
      logits.push_back(xy / std::sqrt(xx * yy) / temperature);
    }
    const long double largest = *std::max_element(logits.begin(), logits.end());
    long double sum = 0.0L, weighted = 0.0L;
    for (const long double logit : logits) {
      const long double e = std::exp(logit - largest);
      sum += e;
      weighted += e * (logit - largest);
    }
    entropies.push_back(std::log(sum) - weighted / sum);
  }
  return entropies;
}

StabilityResult RunEntropy(const Descriptors& descriptors, double temperature, ThreadPool& pool) {
  KeyViewOptions options;
  options.temperature = temperature;
  const std::vector<double> found =
      SoftmaxEntropies(descriptors, std::vector<bool>(descriptors.size(), true), options, pool);
  const std::vector<long double> expected = Entropies(descriptors, temperature);
  StabilityResult r;
  r.condition = std::max(1.0, 1.0 / temperature);
  r.condition_of = "cosine over temperature";
  r.compared = static_cast<int64_t>(found.size());
  r.value_error = 0.0;
  const double most = std::log(static_cast<double>(found.size()));
  for (size_t i = 0; i < found.size(); ++i) {
    r.non_finite += std::isfinite(found[i]) ? 0 : 1;
    r.value_error =
        std::max(r.value_error, static_cast<double>(std::abs(found[i] - expected[i])) / most);
    r.held = r.held && found[i] >= -1e-12 && found[i] <= most + 1e-12;
  }
  // Float64, with cosines that are rounded once.
  r.value_bound = 1e-13 + 1e-15 * r.condition;
  return r;
}

}  // namespace

void AddSoftmaxCases(std::vector<StabilityCase>& cases) {
  for (const char* text : {"1e-6", "1e-4", "1", "1e4", "1e6"}) {
    const double temperature = std::stod(text);
    cases.push_back({"softmax",
                     std::string("key view entropy at temperature ") + text,
                     false,
                     [temperature](ThreadPool& pool) {
                       return RunEntropy(RandomDescriptors(0.5), temperature, pool);
                     }});
  }
  cases.push_back({"softmax", "all views the same, temperature 1e-4", false, [](ThreadPool& pool) {
                     return RunEntropy(RandomDescriptors(0.0), 1e-4, pool);
                   }});
  cases.push_back({"softmax", "views that differ by 1e-8", false, [](ThreadPool& pool) {
                     return RunEntropy(RandomDescriptors(1e-8), 1e-4, pool);
                   }});
  cases.push_back({"softmax", "descriptors of 1e150", false, [](ThreadPool& pool) {
                     Descriptors descriptors = RandomDescriptors(0.5);
                     for (auto& d : descriptors) {
                       for (double& v : d) v *= 1e150;
                     }
                     return RunEntropy(descriptors, 1.0, pool);
                   }});
}

}  // namespace color3d
