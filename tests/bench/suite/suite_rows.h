// Rows of a suite: one JSON line for each finished run. Not thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/bench/suite/suite_plan.h"

namespace color3d {

struct SuiteRow {
  std::string scene;
  std::string preset;
  uint64_t seed = 1;
  std::string options_digest;  // SuiteTask::options_digest
  std::string failure;         // empty: the run succeeded
  double wall_seconds = 0.0;   // of the whole command, cached stages included
  std::string commit;          // of the program; empty: not built from a repository
  std::string machine;         // processor and cores
  nlohmann::ordered_json metrics = nlohmann::ordered_json::object();  // metrics.json
  // Scores by view: "delta_e00_chroma" of each held-out view.
  std::map<std::string, double> view_errors;

  bool Failed() const { return !failure.empty(); }
  bool IsOf(const SuiteTask& task) const {
    return scene == task.scene.name && preset == task.preset.name && seed == task.seed &&
           options_digest == task.options_digest;
  }
  // A number of metrics.json; NaN if there is none.
  double Metric(const std::string& key) const;
};

// Reads a file, none if it does not exist. A line that cannot be read is left out: the last one of
// a suite that was killed. Of several rows of one run the last one counts.
std::vector<SuiteRow> ReadRows(const std::filesystem::path& jsonl);
// Appends a row, on the disk when this returns. A half line at the end is completed first.
void AppendRow(const std::filesystem::path& jsonl, const SuiteRow& row);

// Appends the rows whose scene, preset and seed the file does not have.
void AddMissingRows(const std::filesystem::path& jsonl, const std::vector<SuiteRow>& rows);

// Leaves out rows whose scene, preset and seed were run again later with other options.
std::vector<SuiteRow> NewestRows(const std::vector<SuiteRow>& rows);

// Seconds that a run probably takes: the mean of the finished runs of its scene and preset, else of
// its preset, else of its scene; else 0.
double ExpectedSeconds(const SuiteTask& task, const std::vector<SuiteRow>& rows);

// "Intel(R) Xeon(R) ..., 2 cores".
std::string MachineName();

}  // namespace color3d
