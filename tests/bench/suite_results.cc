#include "tests/bench/suite_results.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <sstream>

#include "core/base/files.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

struct Column {
  const char* title;
  const char* metric;
  const char* format;
};
constexpr Column kColumns[] = {{"dE00 2d", "delta_e00_chroma_2d", "%.2f"},
                               {"dE00 3d", "delta_e00_chroma", "%.2f"},
                               {"bound", "delta_e00_chroma_bound", "%.2f"},
                               {"grey", "delta_e00_gray", "%.2f"},
                               {"colourfulness 2d", "colorfulness_ratio_2d", "%.2f"},
                               {"colourfulness", "colorfulness_ratio", "%.2f"},
                               {"ME", "me", "%.4f"},
                               {"TC", "tc", "%.5f"},
                               {"ME truth", "me_truth", "%.4f"},
                               {"TC truth", "tc_truth", "%.5f"},
                               {"coverage", "coverage", "%.2f"},
                               {"s", "seconds_total", "%.0f"}};
constexpr char kStagePrefix[] = "seconds_";

std::string Cell(const char* format, const std::optional<double>& value) {
  if (!value) return "";
  char text[40];
  std::snprintf(text, sizeof(text), format, *value);
  return text;
}

using Numbers = std::map<std::string, double>;

Numbers NumbersOf(const SuiteRun& run) {
  Numbers numbers;
  for (const auto& [name, value] : run.metrics.items()) {
    if (value.is_number()) numbers[name] = value.get<double>();
  }
  return numbers;
}

std::optional<double> Find(const Numbers& numbers, const std::string& name) {
  const auto found = numbers.find(name);
  if (found == numbers.end()) return std::nullopt;
  return found->second;
}

// "seconds_personalize" and so on, in order of appearance.
std::vector<std::string> StageMetrics(const std::vector<SuiteRun>& runs) {
  std::vector<std::string> stages;
  for (const SuiteRun& run : runs) {
    for (const auto& [name, value] : run.metrics.items()) {
      if (!name.starts_with(kStagePrefix) || name == "seconds_total") continue;
      if (std::find(stages.begin(), stages.end(), name) == stages.end()) stages.push_back(name);
    }
  }
  return stages;
}

// Means of the figures that all runs have.
Numbers MeanOf(const std::vector<Numbers>& all) {
  Numbers mean;
  std::map<std::string, size_t> count;
  for (const Numbers& numbers : all) {
    for (const auto& [name, value] : numbers) {
      mean[name] += value / static_cast<double>(all.size());
      ++count[name];
    }
  }
  for (const auto& [name, n] : count) {
    if (n != all.size()) mean.erase(name);
  }
  return mean;
}

class Table {
 public:
  Table(std::vector<std::string> stages, bool ratios)
      : stages_(std::move(stages)), ratios_(ratios) {
    text_ = "| scene | variant |";
    for (const Column& column : kColumns) Head(column.title);
    if (ratios_) {
      Head("dE00 ratio");
      Head("s ratio");
    }
    for (const std::string& stage : stages_) Head("s " + stage.substr(sizeof(kStagePrefix) - 1));
    text_ += "\n|---|---|";
    for (int i = 0; i < columns_; ++i) text_ += "--:|";
    text_ += "\n";
  }

  void Row(const std::string& scene,
           const std::string& variant,
           const Numbers& numbers,
           const Numbers* baseline) {
    text_ += "| " + scene + " | " + variant + " |";
    for (const Column& column : kColumns) Add(Cell(column.format, Find(numbers, column.metric)));
    if (ratios_) {
      for (const char* name : {"delta_e00_chroma_2d", "seconds_total"}) {
        Add(Cell("%.2f", Ratio(numbers, baseline, name)));
      }
    }
    for (const std::string& stage : stages_) Add(Cell("%.1f", Find(numbers, stage)));
    text_ += "\n";
  }

  const std::string& text() const { return text_; }

 private:
  static std::optional<double> Ratio(const Numbers& numbers,
                                     const Numbers* baseline,
                                     const char* name) {
    if (baseline == nullptr) return std::nullopt;
    const auto value = Find(numbers, name), reference = Find(*baseline, name);
    if (!value || !reference || !(*reference > 0.0)) return std::nullopt;
    return *value / *reference;
  }
  void Head(const std::string& title) {
    Add(title);
    ++columns_;
  }
  void Add(const std::string& cell) { text_ += " " + cell + " |"; }

  std::vector<std::string> stages_;
  bool ratios_;
  int columns_ = 0;
  std::string text_;
};

}  // namespace

std::string SuiteRun::SceneName() const {
  const std::filesystem::path path = std::filesystem::path(scene).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

std::vector<SuiteRun> ReadSuiteResults(const std::filesystem::path& jsonl) {
  std::vector<SuiteRun> runs;
  if (!std::filesystem::exists(jsonl)) return runs;
  std::istringstream lines(ReadFile(jsonl));
  for (std::string line; std::getline(lines, line);) {
    const auto json = ordered_json::parse(line, nullptr, /*allow_exceptions=*/false);
    if (!json.is_object()) continue;
    SuiteRun run;
    try {
      run = {json.at("scene"),
             json.at("variant"),
             json.at("arguments"),
             json.at("seconds"),
             json.at("metrics")};
    } catch (const ordered_json::exception&) {
      continue;
    }
    std::erase_if(runs, [&](const SuiteRun& earlier) { return earlier.SameWork(run); });
    runs.push_back(std::move(run));
  }
  return runs;
}

void AppendSuiteResult(const std::filesystem::path& jsonl, const SuiteRun& run) {
  std::string text = std::filesystem::exists(jsonl) ? ReadFile(jsonl) : std::string();
  if (!text.empty() && text.back() != '\n') text += '\n';
  text += ordered_json{{"scene", run.scene},
                       {"variant", run.variant},
                       {"arguments", run.arguments},
                       {"seconds", run.seconds},
                       {"metrics", run.metrics}}
              .dump() +
          "\n";
  WriteFileAtomic(jsonl, text);
}

std::string SuiteTable(const std::vector<SuiteRun>& runs, const std::string& baseline) {
  std::map<std::string, Numbers> baselines;  // by scene
  std::vector<std::string> variants;         // in order of appearance
  std::map<std::string, std::vector<Numbers>> of_variant;
  for (const SuiteRun& run : runs) {
    const Numbers numbers = NumbersOf(run);
    if (run.variant == baseline) baselines[run.scene] = numbers;
    if (of_variant[run.variant].empty()) variants.push_back(run.variant);
    of_variant[run.variant].push_back(numbers);
  }
  Table table(StageMetrics(runs), !baseline.empty());
  for (const SuiteRun& run : runs) {
    const auto found = baselines.find(run.scene);
    table.Row(run.SceneName(),
              run.variant,
              NumbersOf(run),
              found == baselines.end() ? nullptr : &found->second);
  }
  const Numbers mean_baseline =
      of_variant.contains(baseline) ? MeanOf(of_variant[baseline]) : Numbers{};
  for (const std::string& variant : variants) {
    if (of_variant[variant].size() < 2) continue;
    table.Row("mean", variant, MeanOf(of_variant[variant]), &mean_baseline);
  }
  return table.text();
}

}  // namespace color3d
