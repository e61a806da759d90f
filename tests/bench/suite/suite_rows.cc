#include "tests/bench/suite/suite_rows.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <thread>
#include <tuple>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

auto KeyOf(const SuiteRow& row) {
  return std::tie(row.scene, row.preset, row.seed, row.options_digest);
}

// Of any options.
bool IsSameRun(const SuiteRow& x, const SuiteRow& y) {
  return x.scene == y.scene && x.preset == y.preset && x.seed == y.seed;
}

nlohmann::ordered_json ToJson(const SuiteRow& row) {
  return {{"scene", row.scene},
          {"preset", row.preset},
          {"seed", row.seed},
          {"options", row.options_digest},
          {"failure", row.failure},
          {"wall_seconds", row.wall_seconds},
          {"commit", row.commit},
          {"machine", row.machine},
          {"metrics", row.metrics},
          {"view_errors", row.view_errors}};
}

SuiteRow FromJson(const nlohmann::ordered_json& json) {
  SuiteRow row;
  row.scene = json.at("scene");
  row.preset = json.at("preset");
  row.seed = json.at("seed");
  row.options_digest = json.at("options");
  row.failure = json.at("failure");
  row.wall_seconds = json.at("wall_seconds");
  row.commit = json.at("commit");
  row.machine = json.at("machine");
  row.metrics = json.at("metrics");
  row.view_errors = json.at("view_errors").get<std::map<std::string, double>>();
  return row;
}

// Mean of the seconds of the rows for which `matches` holds; 0 if there is none.
template <class Matches>
double MeanSeconds(const std::vector<SuiteRow>& rows, Matches matches) {
  double sum = 0.0;
  int count = 0;
  for (const SuiteRow& row : rows) {
    if (row.Failed() || !matches(row)) continue;
    sum += row.wall_seconds;
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace

double SuiteRow::Metric(const std::string& key) const {
  const auto found = metrics.find(key);
  return found != metrics.end() && found->is_number() ? found->get<double>()
                                                      : std::numeric_limits<double>::quiet_NaN();
}

std::vector<SuiteRow> ReadRows(const fs::path& jsonl) {
  std::vector<SuiteRow> rows;
  if (!fs::exists(jsonl)) return rows;
  std::istringstream stream(ReadFile(jsonl));
  for (std::string line; std::getline(stream, line);) {
    try {
      SuiteRow row = FromJson(nlohmann::ordered_json::parse(line));
      std::erase_if(rows, [&](const SuiteRow& earlier) { return KeyOf(earlier) == KeyOf(row); });
      rows.push_back(std::move(row));
    } catch (const nlohmann::json::exception&) {
      continue;  // the half line of a suite that was killed
    }
  }
  return rows;
}

void AppendRow(const fs::path& jsonl, const SuiteRow& row) {
  std::string line = ToJson(row).dump() + "\n";
  if (fs::exists(jsonl)) {
    const std::string before = ReadFile(jsonl);
    if (!before.empty() && before.back() != '\n') line = "\n" + line;
  }
  const int file = open(jsonl.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const bool written = file >= 0 &&
                       write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size()) &&
                       fsync(file) == 0;
  if (file >= 0) close(file);
  if (!written) {
    throw Error(ErrorCode::kResourceExhausted,
                "cannot write to {}; free some disk space and repeat the command",
                jsonl.string());
  }
}

void AddMissingRows(const fs::path& jsonl, const std::vector<SuiteRow>& rows) {
  const std::vector<SuiteRow> present = ReadRows(jsonl);
  for (const SuiteRow& row : rows) {
    if (std::none_of(present.begin(), present.end(), [&](const SuiteRow& other) {
          return IsSameRun(other, row);
        })) {
      AppendRow(jsonl, row);
    }
  }
}

std::vector<SuiteRow> NewestRows(const std::vector<SuiteRow>& rows) {
  std::vector<SuiteRow> newest;
  for (auto row = rows.begin(); row != rows.end(); ++row) {
    if (std::none_of(
            row + 1, rows.end(), [&](const SuiteRow& later) { return IsSameRun(*row, later); })) {
      newest.push_back(*row);
    }
  }
  return newest;
}

double ExpectedSeconds(const SuiteTask& task, const std::vector<SuiteRow>& rows) {
  const auto same_scene = [&](const SuiteRow& row) { return row.scene == task.scene.name; };
  const auto same_preset = [&](const SuiteRow& row) { return row.preset == task.preset.name; };
  double seconds =
      MeanSeconds(rows, [&](const SuiteRow& row) { return same_scene(row) && same_preset(row); });
  if (seconds == 0.0) seconds = MeanSeconds(rows, same_preset);
  if (seconds == 0.0) seconds = MeanSeconds(rows, same_scene);
  return seconds;
}

std::string MachineName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) != 0) continue;
    return line.substr(line.find(':') + 2) + ", " +
           std::to_string(std::thread::hardware_concurrency()) + " cores";
  }
  return std::to_string(std::thread::hardware_concurrency()) + " cores";
}

}  // namespace color3d
