// What became of one stage of a graph, as the report tells it. Filled by whoever ran the stages
// (the worker from the store, benchmarks from their own clock), shown by the report.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

struct StageSummary {
  std::string kind;
  std::string state;              // as jobs are told: "SUCCEEDED", "SKIPPED", ...
  std::string skip_reason;        // why the plan left it out
  double seconds = 0.0;           // of computing, over all attempts (of the original when cached)
  int64_t peak_memory_bytes = 0;  // 0: not measured
  std::vector<std::string> warnings;
};

}  // namespace color3d
