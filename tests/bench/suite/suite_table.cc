#include "tests/bench/suite/suite_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace color3d {
namespace {

constexpr double kNoticeable = 0.03;  // relative difference

// The mean over seeds; its interval is that of the views of the rows that have scores by view.
MeanWithInterval ErrorOf(const SuiteCell& cell) {
  std::vector<double> of_views, of_seeds;
  for (const SuiteRow& row : cell.rows) {
    for (const auto& [view, error] : row.view_errors) of_views.push_back(error);
    const double error = row.Metric(kRankingMetric);
    if (std::isfinite(error)) of_seeds.push_back(error);
  }
  MeanWithInterval error = BootstrapMean(of_views.empty() ? of_seeds : of_views);
  const double offset = cell.Mean(kRankingMetric) - error.mean;
  return {error.mean + offset, error.low + offset, error.high + offset};
}

std::string Figure(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "";
}

// The row of a run with `--bound`, with the error of the bound in place of its own.
SuiteRow BoundOf(SuiteRow row) {
  const double error = row.Metric(std::string(kRankingMetric) + "_bound");
  row.view_errors.clear();
  row.metrics = {{kRankingMetric, error},
                 {"delta_e00_gray", row.Metric("delta_e00_gray")},
                 {"seconds_total", row.Metric("seconds_total")}};
  return row;
}

std::string WithInterval(const MeanWithInterval& error) {
  return HasInterval(error) ? fmt::format("{} ({} to {})",
                                          Figure(error.mean, 2),
                                          Figure(error.low, 2),
                                          Figure(error.high, 2))
                            : Figure(error.mean, 2);
}

void FindFrontier(SceneResults* results) {
  std::vector<size_t> by_time;
  for (size_t i = 0; i < results->cells.size(); ++i) {
    const SuiteCell& cell = results->cells[i];
    if (!cell.preset.oracle && cell.Mean("seconds_total") > 0.0) by_time.push_back(i);
  }
  const auto seconds = [&](size_t i) { return results->cells[i].Mean("seconds_total"); };
  std::stable_sort(
      by_time.begin(), by_time.end(), [&](size_t x, size_t y) { return seconds(x) < seconds(y); });
  double best = std::numeric_limits<double>::infinity();
  for (const size_t i : by_time) {
    if (results->cells[i].error.mean >= best) continue;
    best = results->cells[i].error.mean;
    results->frontier.push_back(i);
  }
  const std::vector<size_t>& frontier = results->frontier;
  if (frontier.size() < 3) return;
  const auto x = [&](size_t i) { return std::log(seconds(i)); };
  const auto y = [&](size_t i) { return results->cells[i].error.mean; };
  const double width = x(frontier.back()) - x(frontier.front());
  const double height = y(frontier.front()) - y(frontier.back());
  double farthest = 0.0;
  for (size_t k = 1; k + 1 < frontier.size(); ++k) {
    const double u = (x(frontier[k]) - x(frontier.front())) / width;
    const double v = (y(frontier.front()) - y(frontier[k])) / height;
    if (v - u > farthest) {
      farthest = v - u;
      results->knee = static_cast<int>(k);
    }
  }
}

const SuiteCell* FindCell(const SceneResults& results, const std::string& preset) {
  for (const SuiteCell& cell : results.cells) {
    if (cell.preset.name == preset) return &cell;
  }
  return nullptr;
}

std::string MarkdownOfScene(const SceneResults& results) {
  std::string text =
      fmt::format("\n## {}\n\nWithout colour: {}.\n\n", results.scene, Figure(results.gray, 2));
  text +=
      "| preset | kind | error (95 %) | photos | PSNR of L | colourfulness | ME, common | "
      "Gaussians | "
      "s | seeds | |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|---|\n";
  for (size_t i = 0; i < results.cells.size(); ++i) {
    const SuiteCell& cell = results.cells[i];
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
                        cell.preset.name,
                        KindOf(cell.preset),
                        WithInterval(cell.error),
                        Figure(cell.Mean("delta_e00_chroma_2d"), 2),
                        Figure(cell.Mean("psnr_l"), 1),
                        Figure(cell.Mean("colorfulness_ratio"), 2),
                        Figure(cell.Mean("me_common"), 4),
                        Figure(cell.Mean("gaussians"), 0),
                        Figure(cell.Mean("seconds_total"), 0),
                        cell.rows.size(),
                        FrontierMark(results, i));
  }
  for (const SuiteCell& cell : results.failed) {
    text += fmt::format("| {} | {} | failed | | | | | | | | {} |\n",
                        cell.preset.name,
                        KindOf(cell.preset),
                        cell.failure);
  }
  return text;
}

}  // namespace

std::string KindOf(const SuitePreset& preset) { return preset.oracle ? "oracle" : preset.kind; }

std::string FrontierMark(const SceneResults& results, size_t cell) {
  const auto at = std::find(results.frontier.begin(), results.frontier.end(), cell);
  if (at == results.frontier.end()) return "";
  return at - results.frontier.begin() == results.knee ? "frontier, knee" : "frontier";
}

bool HasInterval(const MeanWithInterval& error) { return error.low < error.high; }

double SuiteCell::Mean(const std::string& metric) const {
  double sum = 0.0;
  int count = 0;
  for (const SuiteRow& row : rows) {
    const double value = row.Metric(metric);
    if (!std::isfinite(value)) continue;
    sum += value;
    ++count;
  }
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

std::vector<SceneResults> SummarizeScenes(const std::vector<SuiteRow>& rows,
                                          const std::vector<SuitePreset>& presets) {
  std::vector<SceneResults> scenes;
  for (const SuiteRow& row : rows) {
    if (std::any_of(scenes.begin(), scenes.end(), [&](const SceneResults& s) {
          return s.scene == row.scene;
        })) {
      continue;
    }
    SceneResults results{row.scene};
    for (const SuitePreset& preset : presets) {
      SuiteCell cell{row.scene, preset, {}, {}, {}};
      for (const SuiteRow& other : rows) {
        if (other.scene != row.scene || other.preset != preset.name) continue;
        if (other.Failed()) {
          cell.failure = other.failure;
        } else {
          cell.rows.push_back(preset.name == kBoundPreset ? BoundOf(other) : other);
        }
      }
      if (cell.Empty()) {
        if (!cell.failure.empty()) results.failed.push_back(std::move(cell));
        continue;
      }
      cell.failure.clear();
      results.cells.push_back(std::move(cell));
    }
    results.gray = std::numeric_limits<double>::quiet_NaN();
    std::erase_if(results.cells,
                  [](const SuiteCell& cell) { return std::isnan(cell.Mean(kRankingMetric)); });
    for (SuiteCell& cell : results.cells) {
      cell.error = ErrorOf(cell);
      const double gray = cell.Mean("delta_e00_gray");
      if (std::isfinite(gray)) results.gray = gray;
    }
    std::stable_sort(results.cells.begin(), results.cells.end(), [](const auto& x, const auto& y) {
      return x.preset.oracle != y.preset.oracle ? y.preset.oracle : x.error.mean < y.error.mean;
    });
    FindFrontier(&results);
    scenes.push_back(std::move(results));
  }
  return scenes;
}

std::vector<PresetSummary> SummarizePresets(const std::vector<SceneResults>& scenes,
                                            const std::vector<SuitePreset>& presets) {
  std::vector<PresetSummary> summaries;
  for (const SuitePreset& preset : presets) {
    PresetSummary summary{preset};
    double log_error = 0.0, log_seconds = 0.0;
    for (const SceneResults& scene : scenes) {
      const SuiteCell* cell = FindCell(scene, preset.name);
      const SuiteCell* of_default = FindCell(scene, kDefaultPreset);
      if (cell == nullptr || of_default == nullptr) continue;
      ++summary.scenes;
      log_error += std::log(cell->error.mean / of_default->error.mean);
      log_seconds += std::log(cell->Mean("seconds_total") / of_default->Mean("seconds_total"));
    }
    if (summary.scenes == 0) continue;
    summary.error_ratio = std::exp(log_error / summary.scenes);
    summary.time_ratio = std::exp(log_seconds / summary.scenes);
    summaries.push_back(std::move(summary));
  }
  std::stable_sort(summaries.begin(), summaries.end(), [](const auto& x, const auto& y) {
    return x.error_ratio < y.error_ratio;
  });
  return summaries;
}

std::vector<ClaimResult> TestClaims(const std::vector<SceneResults>& scenes) {
  std::vector<ClaimResult> results;
  for (const PaperClaim& claim : PaperClaims()) {
    ClaimResult result{claim};
    if (*claim.better == '\0') {
      result.verdict = "cannot be tested";
      results.push_back(result);
      continue;
    }
    double log_ratio = 0.0;
    for (const SceneResults& scene : scenes) {
      const SuiteCell* better = FindCell(scene, claim.better);
      const SuiteCell* worse = FindCell(scene, claim.worse);
      if (better == nullptr || worse == nullptr) continue;
      const double ratio = better->Mean(claim.metric) / worse->Mean(claim.metric);
      if (!std::isfinite(ratio) || ratio <= 0.0) continue;
      ++result.scenes;
      result.holds_on += ratio < 1.0 ? 1 : 0;
      log_ratio += std::log(ratio);
    }
    if (result.scenes == 0) {
      result.verdict = "not run";
    } else {
      result.ratio = std::exp(log_ratio / result.scenes);
      const int against = result.scenes - result.holds_on;
      if (result.ratio < 1.0 - kNoticeable && 2 * result.holds_on > result.scenes) {
        result.verdict = "holds";
      } else if (result.ratio > 1.0 + kNoticeable && 2 * against > result.scenes) {
        result.verdict = "does not hold";
      } else {
        result.verdict = "no difference";
      }
    }
    results.push_back(result);
  }
  return results;
}

std::string SuiteMarkdown(const std::vector<SceneResults>& scenes,
                          const std::vector<PresetSummary>& presets,
                          const std::vector<ClaimResult>& claims) {
  std::string text =
      "Relative to the default (geometric means over the scenes that have both).\n\n"
      "| preset | kind | scenes | error | time |\n|---|---|--:|--:|--:|\n";
  for (const PresetSummary& p : presets) {
    text += fmt::format("| {} | {} | {} | {:.2f} | {} |\n",
                        p.preset.name,
                        KindOf(p.preset),
                        p.scenes,
                        p.error_ratio,
                        Figure(p.time_ratio, 2));
  }
  for (const SceneResults& scene : scenes) text += MarkdownOfScene(scene);
  text +=
      "\n## Claims of the paper\n\n| claim | compared | metric | scenes | ratio | verdict |\n"
      "|---|---|---|--:|--:|---|\n";
  for (const ClaimResult& result : claims) {
    const bool tested = result.scenes > 0;
    text += fmt::format("| {} | {} | {} | {} | {} | {} |\n",
                        result.claim.text,
                        *result.claim.better == '\0'
                            ? std::string(result.claim.note)
                            : fmt::format("{} against {}", result.claim.better, result.claim.worse),
                        result.claim.metric,
                        tested ? fmt::format("{} of {}", result.holds_on, result.scenes) : "",
                        tested ? fmt::format("{:.2f}", result.ratio) : "",
                        result.verdict);
  }
  return text;
}

}  // namespace color3d
