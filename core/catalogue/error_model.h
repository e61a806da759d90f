// Expected and estimated error of the colours of a run (core/METHOD.md, "Plan and error of a run").
// Plans, progress and the report share it. Pure functions, thread-safe.
#pragma once

#include <optional>
#include <span>

namespace color3d {

// Curves that the estimate is made of, and the chroma solver's error on held-out views.
inline constexpr char kCoverageCurve[] = "coverage";                  // of carry_color
inline constexpr char kValidationCurve[] = "validation_delta_e00";    // of personalize
inline constexpr char kDisagreementCurve[] = "view_disagreement_ab";  // of solve_chroma
inline constexpr char kHeldOutChromaCurve[] = "heldout_delta_e00";    // of solve_chroma
// Score of evaluate: error against true colours.
inline constexpr char kScoreCurve[] = "delta_e00_chroma";

// What a run without truth knows about its colours.
struct RunState {
  double carried_share = 0.0;  // of the pixels, 0..1
  // CIEDE2000 of the colorizer on parts of the key view that it did not learn from.
  double uncovered_error = 0.0;
  // Mean difference of a, b between the colours of the training views and renders of their mean on
  // the Gaussians. nullopt before chroma is solved.
  std::optional<double> disagreement;
};

// Estimated CIEDE2000 of the colours.
double EstimatedError(const RunState& run);

// Expected error after an additional key view was coloured. `error`: without it. `ratio`: of the
// errors that coverage alone lets expect (core/keyview/expected_error.h), with the view to without.
double ErrorWithNextKeyView(double error, double ratio);

// Shares of the schedules of geometry and personalization that a time budget leaves, 0..1.
struct ScheduleShares {
  double geometry = 1.0;
  double personalize = 1.0;
};

// Error of a run with shortened schedules, divided by that of a run with full ones; at least 1.
double ErrorGrowth(const ScheduleShares& shares);

// Expected error, and the interval that holds four of five scenes.
struct ErrorInterval {
  double error = 0.0;
  double low = 0.0;
  double high = 0.0;

  ErrorInterval Times(double factor) const { return {error * factor, low * factor, high * factor}; }
};

// Of a scene about which nothing is known, from the errors of other scenes with one key view.
// Requires: key_views >= 1.
ErrorInterval ExpectFromOtherScenes(int key_views);
// Of a scene with an earlier run: from its state at the end, or its score against true colours.
ErrorInterval ExpectFromRun(const RunState& run);
ErrorInterval ExpectFromScore(double score);

// Calibration, for the tests and the documents.
struct CalibrationScene {
  const char* name;
  double error;  // with one key view and the preset fast (tests/bench/RESULTS.md)
};
std::span<const CalibrationScene> CalibrationScenes();
struct CalibrationRun {
  const char* name;
  const char* scene;
  RunState end;
  double error;
};
std::span<const CalibrationRun> CalibrationRuns();
// Geometric mean of positive numbers, and the interval that a further one lies in with a
// probability of 80 % if logarithms are normally distributed. Requires: at least 3 numbers.
ErrorInterval PredictNext(std::span<const double> errors);

}  // namespace color3d
