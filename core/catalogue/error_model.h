// Expected and estimated error of the colours of a run (core/METHOD.md, "Plan and error of a run").
// Plans, progress and the report share it. Pure functions, thread-safe.
#pragma once

#include <span>

namespace color3d {

// Curves that the estimate is made of, and the chroma solver's error on held-out views.
inline constexpr char kCoverageCurve[] = "coverage";                // of carry_color
inline constexpr char kValidationCurve[] = "validation_delta_e00";  // of personalize
inline constexpr char kHeldOutChromaCurve[] = "heldout_delta_e00";  // of solve_chroma
// Score of evaluate: error against true colours.
inline constexpr char kScoreCurve[] = "delta_e00_chroma";

// CIEDE2000 of the colours, as far as a run without truth knows it. `carried_share`: of the pixels
// with carried colours, 0..1. `uncovered_error`: of the colorizer on parts of the key view that it
// did not learn from.
double EstimatedError(double carried_share, double uncovered_error);

// Shares of the schedules of geometry and personalization that a time budget leaves, 0..1.
struct ScheduleShares {
  double geometry = 1.0;
  double personalize = 1.0;
};

// Error of a run with shortened schedules, divided by that of a run with full ones; at least 1.
double ErrorGrowth(const ScheduleShares& shares);

// Expected error, and the interval that holds four of five scenes.
struct ExpectedError {
  double error = 0.0;
  double low = 0.0;
  double high = 0.0;

  ExpectedError Times(double factor) const { return {error * factor, low * factor, high * factor}; }
};

// Of a scene about which nothing is known, from the errors of other scenes with one key view.
// Requires: key_views >= 1.
ExpectedError ExpectFromOtherScenes(int key_views);
// Of a scene with an earlier run, whose estimate or score against true colours is given.
ExpectedError ExpectFromEstimate(double estimate);
ExpectedError ExpectFromScore(double score);

// Calibration, for the tests and the documents.
struct CalibrationScene {
  const char* name;
  double error;  // with one key view and the preset fast (tests/bench/RESULTS.md)
};
std::span<const CalibrationScene> CalibrationScenes();
struct CalibrationRun {
  const char* name;
  const char* scene;
  double carried_share;
  double uncovered_error;
  double error;
};
std::span<const CalibrationRun> CalibrationRuns();
// Geometric mean of positive numbers, and the interval that a further one lies in with a
// probability of 80 % if logarithms are normally distributed. Requires: at least 3 numbers.
ExpectedError PredictNext(std::span<const double> errors);

}  // namespace color3d
