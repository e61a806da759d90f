// What scripted jobs leave behind (scripted_worker.cc): which steps were done by which processes,
// and effects that may be there once only.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace color3d::testing {

// Steps of a trace ("step pid" lines) in order, and the processes that did them.
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

// The same text without the processes: equal work leaves equal text, whoever did it.
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

// (job, step) lines that are there more than once.
inline int RepeatedEffects(const std::filesystem::path& log) {
  std::map<std::string, int> counts;
  std::ifstream stream(log);
  for (std::string line; std::getline(stream, line);) ++counts[line];
  int repeated = 0;
  for (const auto& [effect, count] : counts) repeated += count > 1 ? 1 : 0;
  return repeated;
}

}  // namespace color3d::testing
