// Adam with gradients from 1e-30 to 1e30, whose squares float32 cannot hold, against float64.
#include <algorithm>
#include <cmath>

#include "core/splat/training/adam.h"
#include "tests/stability/stability_case.h"

namespace color3d {
namespace {

constexpr int kSteps = 25;
constexpr float kRate = 1e-3f;

using Gradient = std::function<double(int gaussian, int step)>;

// One parameter, initially zero.
double ReferenceAdam(const Gradient& gradient, int gaussian) {
  double p = 0.0, first = 0.0, second = 0.0;
  for (int step = 1; step <= kSteps; ++step) {
    const double g = static_cast<float>(gradient(gaussian, step));
    first += (1.0 - kAdamBeta1) * (g - first);
    second += (1.0 - kAdamBeta2) * (g * g - second);
    const double bias1 = 1.0 - std::pow(double{kAdamBeta1}, step);
    const double bias2 = 1.0 - std::pow(double{kAdamBeta2}, step);
    p -= kRate * (first / bias1) / (std::sqrt(second / bias2) + kAdamEpsilon);
  }
  return p;
}

StabilityResult Run(int count, const Gradient& gradient, double condition, ThreadPool& pool) {
  ParameterBlock g(1, count), p(1, count);
  AdamMoments moments{ParameterBlock(1, count), ParameterBlock(1, count)};
  StabilityResult result;
  for (int step = 1; step <= kSteps; ++step) {
    for (int i = 0; i < count; ++i) g.Row(0)[i] = static_cast<float>(gradient(i, step));
    result.held = AdamStep(g, {kRate}, step, pool, p, moments) && result.held;
  }
  for (const ParameterBlock* block : {&p, &moments.first, &moments.second}) {
    result.non_finite += CountNonFinite(block->values().data(), block->values().size());
  }
  result.condition = condition;
  result.condition_of = "largest / smallest gradient";
  result.compared = count;
  result.value_error = 0.0;
  for (int i = 0; i < count; ++i) {
    const double expected = ReferenceAdam(gradient, i);
    // Steps below 1e-6 of the learning rate do not matter.
    const double error =
        std::abs(p.Row(0)[i] - expected) / std::max(std::abs(expected), 1e-6 * kRate);
    result.value_error = std::isnan(error) ? std::numeric_limits<double>::infinity()
                                           : std::max(result.value_error, error);
  }
  // Below 3.4e-18 the second moment underflows to zero beside Adam's eps of 1e-15.
  result.value_bound = 4e-3;
  return result;
}

// AdamStep must report such a gradient.
StabilityResult RunSpoilt(float bad, ThreadPool& pool) {
  ParameterBlock g(2, 20), p(2, 20);
  AdamMoments moments{ParameterBlock(2, 20), ParameterBlock(2, 20)};
  g.Row(1)[17] = bad;
  StabilityResult result;
  result.held = !AdamStep(g, {kRate, kRate}, 1, pool, p, moments);
  result.outcome = result.held ? "reported" : "not reported";
  result.condition_of = "-";
  return result;
}

}  // namespace

void AddAdamCases(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, int count, double condition, Gradient gradient) {
    cases.push_back({"adam", name, false, [=](ThreadPool& pool) {
                       return Run(count, gradient, condition, pool);
                     }});
  };
  const auto size = [](int i) { return std::pow(10.0, i - 30); };
  add("steady gradients of 1e-30..1e30", 61, 1e60, [=](int i, int) { return size(i); });
  add("alternating gradients of 1e-30..1e30", 61, 1e60, [=](int i, int step) {
    return step % 3 == 0 ? -size(i) : size(i);
  });
  add("gradients that fade by 10 a step", 40, 1e25, [](int i, int step) {
    return std::pow(10.0, i / 4.0 - step);
  });
  add("gradients of zero", 17, 1.0, [](int, int) { return 0.0; });
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    cases.push_back({"adam",
                     std::isnan(bad) ? "a gradient that is NaN" : "a gradient that is infinite",
                     false,
                     [bad](ThreadPool& pool) { return RunSpoilt(bad, pool); }});
  }
}

}  // namespace color3d
