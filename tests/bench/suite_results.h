// Results of `color3d-bench suite`: one JSON line per finished run, and the table over them.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace color3d {

// A run of one scene with one set of options.
struct SuiteRun {
  std::string scene;  // the folder as given
  std::string variant;
  std::vector<std::string> arguments;  // of `color3d-bench pipeline`, except scene and folder
  double seconds = 0.0;                // of the whole process
  nlohmann::ordered_json metrics;      // metrics.json; null before it has run

  // Last component of the scene's folder.
  std::string SceneName() const;
  bool SameWork(const SuiteRun& other) const {
    return scene == other.scene && variant == other.variant && arguments == other.arguments;
  }
};

// Reads the runs of a file, none if it does not exist. Ignores unreadable lines (the last one of a
// killed suite). Later lines override earlier ones of the same work.
std::vector<SuiteRun> ReadSuiteResults(const std::filesystem::path& jsonl);
// Appends a line durably.
void AppendSuiteResult(const std::filesystem::path& jsonl, const SuiteRun& run);

// Returns Markdown: a row per run, in order, then a row with the mean of each variant with several
// scenes. With a `baseline` variant: columns with the ratios of error and seconds to it.
std::string SuiteTable(const std::vector<SuiteRun>& runs, const std::string& baseline);

}  // namespace color3d
