// What the rows of a suite say: a cell for each scene and preset, the frontier of error and time,
// and claims. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "core/metrics/confidence_interval.h"
#include "tests/bench/suite/suite_plan.h"
#include "tests/bench/suite/suite_rows.h"

namespace color3d {

// The metric that ranks: mean CIEDE2000 of chroma of held-out views.
inline constexpr char kRankingMetric[] = "delta_e00_chroma";

// All runs of a scene with a preset.
struct SuiteCell {
  std::string scene;
  SuitePreset preset;
  std::vector<SuiteRow> rows;  // that succeeded
  std::string failure;         // of the last failed run; empty if one succeeded
  // Mean over seeds, interval over views and seeds; over seeds if there are no scores by view.
  MeanWithInterval error;

  bool Empty() const { return rows.empty(); }
  // Mean over the rows that have the metric; NaN if there is none.
  double Mean(const std::string& metric) const;
};

struct SceneResults {
  std::string scene;
  std::vector<SuiteCell> cells;  // with rows, least error first; oracles last
  std::vector<SuiteCell> failed;
  double gray = 0.0;  // error of no colour; NaN if unknown
  // Indices of `cells`: no other cell without an oracle is both faster and better. By time.
  std::vector<size_t> frontier;
  // Index in `frontier` of the knee: the point farthest from the line between its ends, in the
  // logarithm of seconds and in error, both scaled to 0..1. -1 with fewer than three points.
  int knee = -1;
};

// "frontier", "frontier, knee" or "". `cell`: index of `results.cells`.
std::string FrontierMark(const SceneResults& results, size_t cell);
// False for the mean of a single value.
bool HasInterval(const MeanWithInterval& error);

// Scenes in the order of their first row.
std::vector<SceneResults> SummarizeScenes(const std::vector<SuiteRow>& rows,
                                          const std::vector<SuitePreset>& presets);

// "oracle", "ours", "baseline", "paper" or "ablation".
std::string KindOf(const SuitePreset& preset);

// Geometric means over the scenes that have both the preset and the default.
struct PresetSummary {
  SuitePreset preset;
  int scenes = 0;
  double error_ratio = 0.0;  // error divided by that of the default
  double time_ratio = 0.0;   // the same of seconds; NaN if some are unknown
};
// Least error_ratio first.
std::vector<PresetSummary> SummarizePresets(const std::vector<SceneResults>& scenes,
                                            const std::vector<SuitePreset>& presets);

// A claim of the paper that compares two presets, or one that cannot be tested here.
struct PaperClaim {
  const char* text;
  const char* better;  // preset that the claim says is better; empty: cannot be tested
  const char* worse;
  const char* metric;  // smaller is better
  const char* note;    // what is compared, or why it cannot be tested
};
const std::vector<PaperClaim>& PaperClaims();

struct ClaimResult {
  PaperClaim claim;
  int scenes = 0;       // with both presets
  int holds_on = 0;     // scenes where `better` has the smaller metric
  double ratio = 0.0;   // geometric mean of better / worse
  std::string verdict;  // "holds", "does not hold", "no difference", "not run", "cannot be tested"
};
// A claim holds, or not, if the ratio differs from 1 by more than 3 % and more than half of the
// scenes agree; else there is no difference.
std::vector<ClaimResult> TestClaims(const std::vector<SceneResults>& scenes);

std::string SuiteMarkdown(const std::vector<SceneResults>& scenes,
                          const std::vector<PresetSummary>& presets,
                          const std::vector<ClaimResult>& claims);

}  // namespace color3d
