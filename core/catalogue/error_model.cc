#include "core/catalogue/error_model.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr CalibrationScene kScenes[] = {{"fern", 1.64},
                                        {"fox", 3.49},
                                        {"banana", 2.20},
                                        {"sceaux", 5.24},
                                        {"head", 5.83},
                                        {"lady_running", 3.51},
                                        {"man_walking", 4.42},
                                        {"athlete4cam", 1.56}};

constexpr CalibrationRun kRuns[] = {
    {"fern", "fern", {0.811, 3.96, 0.989}, 1.66},
    {"banana", "banana", {0.470, 2.90, 0.936}, 2.22},
    {"banana, two key views", "banana", {0.908, 2.26, 0.964}, 1.82},
    {"fox", "fox", {0.557, 3.36, 1.260}, 3.52},
    {"sceaux", "sceaux", {0.603, 4.48, 1.707}, 5.10},
    {"rendered room", "rendered room", {0.677, 5.09, 1.601}, 4.32},
    {"lady_running", "lady_running", {0.355, 4.60, std::nullopt}, 3.60},
    {"lady_running, two key frames", "lady_running", {0.583, 5.06, std::nullopt}, 2.72}};

// Fitted to kRuns.
constexpr double kCarriedError = 1.5;
constexpr double kDisagreementFactor = 1.62;
constexpr double kDisagreementExponent = 1.5;

// The error falls with the number of key views k as k^-kKeyViewExponent. Measured: 0.91 times with
// two (mean of six captures), 0.85 times with four (mean of four).
constexpr double kKeyViewExponent = 0.125;

// Coverage alone expects too much of a further key view.
constexpr double kNextKeyViewExponent = 0.5;

// Relative growth of the error without geometry's and without personalization's schedule.
constexpr double kGeometryGrowth = 0.10;
constexpr double kPersonalizeGrowth = 0.01;

// A score of the same scene and key view: other seeds and budgets.
constexpr double kScoreSpread = 1.1;

// 90th percentile of Student's t for 2 to 12 degrees of freedom.
double Quantile90(size_t degrees) {
  constexpr double kT[] = {
      1.886, 1.638, 1.533, 1.476, 1.440, 1.415, 1.397, 1.383, 1.372, 1.363, 1.356};
  return kT[std::min(degrees - 2, std::size(kT) - 1)];
}

}  // namespace

std::span<const CalibrationScene> CalibrationScenes() { return kScenes; }
std::span<const CalibrationRun> CalibrationRuns() { return kRuns; }

ErrorInterval PredictNext(std::span<const double> errors) {
  const size_t n = errors.size();
  if (n < 3) throw Error(ErrorCode::kInternal, "{} errors tell no interval; at least 3 do", n);
  double sum = 0.0, squares = 0.0;
  for (const double error : errors) sum += std::log(error);
  const double mean = sum / static_cast<double>(n);
  for (const double error : errors) squares += std::pow(std::log(error) - mean, 2);
  const double deviation = std::sqrt(squares / static_cast<double>(n - 1));
  const double half = Quantile90(n - 1) * deviation * std::sqrt(1.0 + 1.0 / static_cast<double>(n));
  return {std::exp(mean), std::exp(mean - half), std::exp(mean + half)};
}

double EstimatedError(const RunState& run) {
  if (run.disagreement) {
    return kDisagreementFactor * (2.0 - run.carried_share) *
           std::pow(*run.disagreement, kDisagreementExponent);
  }
  return run.carried_share * kCarriedError + (1.0 - run.carried_share) * run.uncovered_error;
}

double ErrorWithNextKeyView(double error, double ratio) {
  return error * std::pow(ratio, kNextKeyViewExponent);
}

double ErrorGrowth(const ScheduleShares& shares) {
  return 1.0 + kGeometryGrowth * (1.0 - shares.geometry) +
         kPersonalizeGrowth * (1.0 - shares.personalize);
}

ErrorInterval ExpectFromOtherScenes(int key_views) {
  std::vector<double> errors;
  for (const CalibrationScene& scene : kScenes) errors.push_back(scene.error);
  return PredictNext(errors).Times(std::pow(key_views, -kKeyViewExponent));
}

ErrorInterval ExpectFromRun(const RunState& run) {
  std::vector<double> ratios;
  for (const CalibrationRun& other : kRuns) {
    if (run.disagreement && !other.end.disagreement) continue;
    RunState as_known = other.end;
    if (!run.disagreement) as_known.disagreement.reset();
    ratios.push_back(other.error / EstimatedError(as_known));
  }
  return PredictNext(ratios).Times(EstimatedError(run));
}

ErrorInterval ExpectFromScore(double score) {
  return {score, score / kScoreSpread, score * kScoreSpread};
}

}  // namespace color3d
