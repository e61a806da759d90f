// Outcome of one stage of a graph. Filled by the worker from the store, or by a benchmark from its
// own clock; shown by the report.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

struct StageSummary {
  std::string kind;
  std::string state;               // of its job: "SUCCEEDED", "SKIPPED", ...
  std::string skip_reason;         // reason for which the plan leaves it out
  double seconds = 0.0;            // of computing, over all attempts (of the original when cached)
  double expected_seconds = -1.0;  // by the plan, on two cores; < 0: unknown
  int64_t peak_memory_bytes = 0;   // 0: not measured
  int64_t expected_peak_memory_bytes = 0;  // by the plan, as in PlannedStage; 0: unknown
  std::vector<std::string> warnings;
};

}  // namespace color3d
