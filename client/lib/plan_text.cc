#include "client/lib/plan_text.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/lib/text.h"

namespace color3d::client {
namespace {

std::string InWords(std::string kind) {
  std::replace(kind.begin(), kind.end(), '_', ' ');
  return kind;
}

// Rows of the stages that run, or of those that are left out.
std::string StageTable(const v1::JobPlan& plan, bool runs, const std::string& heading) {
  std::vector<std::vector<std::string>> rows = {{heading, "seconds", "memory", "reason"}};
  for (const v1::PlannedStage& stage : plan.stages()) {
    if (stage.runs() != runs) continue;
    const double seconds = stage.expected_seconds();
    const int64_t bytes = stage.expected_peak_memory_bytes();
    rows.push_back({InWords(stage.kind()),
                    seconds > 0.0 ? HumanSeconds(seconds) : "-",
                    bytes > 0 ? HumanBytes(bytes) : "-",
                    stage.reason()});
  }
  return rows.size() > 1 ? Table(std::move(rows)) : "";
}

std::string OriginOfErrors(const v1::JobPlan& plan) {
  switch (plan.error_basis()) {
    case v1::ERROR_BASIS_ESTIMATE:
      return "by the estimate of " + plan.error_job();
    case v1::ERROR_BASIS_SCORE:
      return "by the score of " + plan.error_job() + " against true colours";
    default:
      return "by the errors of other scenes, because nothing is known about this one; an estimate "
             "follows when the colorizer is trained";
  }
}

// Expected error for each time budget; empty if there are none.
std::string ErrorTable(const v1::JobPlan& plan) {
  if (plan.budget_errors().empty()) return "";
  std::vector<std::vector<std::string>> rows = {{"time budget", "expected error"}};
  for (const v1::BudgetError& row : plan.budget_errors()) {
    rows.push_back(
        {HumanSeconds(row.budget_seconds()),
         row.too_short()
             ? fmt::format("too short, at least {:.0f} s", plan.shortest_budget_seconds())
             : fmt::format("{:.1f} ({:.1f} to {:.1f})", row.error(), row.low(), row.high())});
  }
  return Table(std::move(rows)) +
         fmt::format("CIEDE2000 of new views, and where four of five scenes lie; {}\n",
                     OriginOfErrors(plan));
}

}  // namespace

std::string PlanText(const v1::JobPlan& plan) {
  std::string text =
      StageTable(plan, true, "runs") + StageTable(plan, false, "left out") + ErrorTable(plan);
  text += fmt::format("expected: {} of computing", HumanSeconds(plan.expected_seconds()));
  if (plan.saved_seconds() >= 0.05) {
    text += fmt::format("; {} saved", HumanSeconds(plan.saved_seconds()));
  }
  text += plan.measured_jobs() > 0
              ? fmt::format(
                    " (this server takes {:.1f} times the seconds of two cores of the "
                    "reference machine, by its last {} jobs)",
                    plan.machine_factor(),
                    plan.measured_jobs())
              : " (two cores of the reference machine; this server has not run enough jobs to know "
                "its own speed)";
  text += "\n";
  if (plan.expected_peak_memory_bytes() == 0) return text;  // of an older server
  text += fmt::format("expected peak memory: {}", HumanBytes(plan.expected_peak_memory_bytes()));
  if (plan.saved_memory_bytes() > 0) {
    text += fmt::format("; {} saved", HumanBytes(plan.saved_memory_bytes()));
  }
  return text + "\n";
}

bool IsWithinAThird(double expected, double measured) {
  return std::abs(expected - measured) <= measured / 3.0;
}

std::string MemoryCheckText(int64_t expected_bytes, int64_t measured_bytes) {
  std::string text = fmt::format("expected a peak memory of {}, measured {}",
                                 HumanBytes(expected_bytes),
                                 HumanBytes(measured_bytes));
  if (!IsWithinAThird(static_cast<double>(expected_bytes), static_cast<double>(measured_bytes))) {
    text += measured_bytes > expected_bytes
                ? ": more than a third off (large photos need more while they are decoded)"
                : ": more than a third off (the plan assumes the maximum number of Gaussians)";
  }
  return text;
}

std::string PlanCheckText(double expected_seconds, double measured_seconds) {
  return fmt::format("expected {} of computing, took {}{}",
                     HumanSeconds(expected_seconds),
                     HumanSeconds(measured_seconds),
                     IsWithinAThird(expected_seconds, measured_seconds)
                         ? ""
                         : ": more than a third off (this machine was faster or slower in "
                           "the jobs that the plan knows)");
}

}  // namespace color3d::client
