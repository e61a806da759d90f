#include "tests/stability/stability_case.h"

#include <chrono>
#include <cmath>
#include <exception>

namespace color3d {
namespace {

// kNotCompared passes; comparisons never return NaN (see raster_compare.h).
bool Within(double error, double bound) { return std::isnan(error) || error <= bound; }

}  // namespace

bool StabilityResult::Passed() const {
  return held && non_finite == 0 && Within(value_error, value_bound) &&
         Within(gradient_error, gradient_bound);
}

std::vector<StabilityCase> StabilityCases() {
  std::vector<StabilityCase> cases;
  AddRasterCases(cases);
  AddLossCases(cases);
  AddAdamCases(cases);
  AddGeometryCases(cases);
  AddMotionCases(cases);
  AddChromaCases(cases);
  AddMatchingCases(cases);
  AddColorizerCases(cases);
  AddGridCases(cases);
  AddCarryCases(cases);
  AddSoftmaxCases(cases);
  AddColorCases(cases);
  AddFilmCases(cases);
  AddFormatCases(cases);
  AddPoseCases(cases);
  return cases;
}

StabilityResult RunStabilityCase(const StabilityCase& stability_case, ThreadPool& pool) {
  const auto start = std::chrono::steady_clock::now();
  StabilityResult result;
  try {
    result = stability_case.run(pool);
  } catch (const std::exception& e) {
    result.held = false;
    result.outcome = std::string("unexpected: ") + e.what();
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

int64_t CountNonFinite(const float* values, size_t count) {
  int64_t bad = 0;
  for (size_t i = 0; i < count; ++i) bad += std::isfinite(values[i]) ? 0 : 1;
  return bad;
}

}  // namespace color3d
