// Traces of scripted jobs (scripted_worker.cc): steps with their processes, and effects that must
// occur only once.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace color3d::testing {

// Steps of a trace ("step pid" lines) in order, and their processes.
struct Trace {
  std::vector<int> steps;
  std::set<int> processes;
};

inline Trace ParseTrace(const std::string& text) {
  Trace trace;
  std::stringstream stream(text.substr(text.find('\n') + 1));
  int step = 0;
  int process = 0;
  while (stream >> step >> process) {
    trace.steps.push_back(step);
    trace.processes.insert(process);
  }
  return trace;
}

// The trace without processes: equal work gives equal text.
inline std::string WithoutProcesses(const std::string& text) {
  std::string plain;
  std::stringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const bool is_step = !line.empty() && line[0] >= '0' && line[0] <= '9';
    plain += (is_step ? line.substr(0, line.find(' ')) : line) + "\n";
  }
  return plain;
}

inline std::vector<int> Range(int count) {
  std::vector<int> range;
  for (int i = 0; i < count; ++i) range.push_back(i);
  return range;
}

// (job, step) lines that occur more than once.
inline int RepeatedEffects(const std::filesystem::path& log) {
  std::map<std::string, int> counts;
  std::ifstream stream(log);
  for (std::string line; std::getline(stream, line);) ++counts[line];
  int repeated = 0;
  for (const auto& [effect, count] : counts) repeated += count > 1 ? 1 : 0;
  return repeated;
}

}  // namespace color3d::testing
