#include "tests/bench/suite/suite_plan.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kResultsPrefix = "results:";

std::string Trimmed(const std::string& text) {
  const size_t begin = text.find_first_not_of(' ');
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

// The cells of "| a | b |".
std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line.substr(1));
  for (std::string cell; std::getline(stream, cell, '|');) cells.push_back(Trimmed(cell));
  return cells;
}

std::vector<std::string> Words(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

bool ChoosesKeyView(const SuitePreset& preset) {
  const auto& options = preset.arguments;
  return std::find(options.begin(), options.end(), "--keys") != options.end() ||
         (!preset.file.empty() &&
          ReadFile(preset.file).find("\nselect_key_view {") != std::string::npos);
}

// Of a run whose colorizer is used; {"", ""} if the preset uses none.
std::pair<std::string, std::string> SceneAndPresetOfColorizer(const SuitePreset& preset) {
  for (const std::string& argument : preset.arguments) {
    if (!argument.starts_with(kResultsPrefix)) continue;
    const std::string run = argument.substr(kResultsPrefix.size());
    const size_t slash = run.find('/');
    if (slash == std::string::npos) {
      throw InvalidArgument(
          "{}: expected {}SCENE/PRESET, got {}", preset.name, kResultsPrefix, argument);
    }
    return {run.substr(0, slash), run.substr(slash + 1)};
  }
  return {};
}

SuiteTask TaskOf(const SuiteScene& scene, const SuitePreset& preset, uint64_t seed) {
  SuiteTask task{scene, preset, seed, {}};
  nlohmann::json facts = {scene.name, scene.key_view, scene.arguments, preset.name};
  if (!preset.file.empty()) facts.push_back(ReadFile(preset.file));
  if (!preset.arguments.empty()) facts.push_back(preset.arguments);
  task.options_digest = Sha256Hex(facts.dump()).substr(0, 12);
  return task;
}

template <class T>
std::vector<T> Select(const std::vector<T>& all,
                      const std::vector<std::string>& names,
                      const std::string& what) {
  if (names.empty()) return all;
  std::vector<std::string> known;
  for (const T& element : all) known.push_back(element.name);
  std::vector<T> selected;
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) {
      throw InvalidArgument("there is no {} {}; there are {}", what, name, Joined(known));
    }
    selected.push_back(all[static_cast<size_t>(at - known.begin())]);
  }
  return selected;
}

}  // namespace

std::vector<SuitePreset> ReadPresetTable(const fs::path& markdown) {
  std::vector<SuitePreset> presets;
  std::istringstream stream(ReadFile(markdown));
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    // A row begins with a name in lower case; the header row with "name".
    if (line.size() < 3 || line.rfind("| ", 0) != 0 || line[2] < 'a' || line[2] > 'z') continue;
    const std::vector<std::string> cells = Cells(line);
    if (cells[0] == "name") continue;
    if (cells.size() < 5 || (cells[3] != "yes" && cells[3] != "no")) {
      throw InvalidArgument("{}:{}: expected | name | file | kind | oracle: yes or no | claim |",
                            markdown.string(),
                            number);
    }
    SuitePreset preset{cells[0], {}, cells[2], cells[3] == "yes", cells[4], Words(cells[1])};
    if (preset.arguments.empty()) {
      throw InvalidArgument("{}:{}: the file of {} is missing; `-` is a preset of the server",
                            markdown.string(),
                            number,
                            preset.name);
    }
    const std::string file = preset.arguments.front();
    preset.arguments.erase(preset.arguments.begin());
    if (file != "-") {
      preset.file = markdown.parent_path() / file;
      if (!fs::exists(preset.file)) {
        throw InvalidArgument(
            "{}:{}: there is no file {}", markdown.string(), number, preset.file.string());
      }
    }
    presets.push_back(std::move(preset));
  }
  if (presets.empty()) throw InvalidArgument("{} has no table of presets", markdown.string());
  return presets;
}

SuiteScenes ReadManifest(const fs::path& json, const fs::path& data) {
  SuiteScenes scenes;
  size_t entry = 0;
  try {
    const nlohmann::json manifest = nlohmann::json::parse(ReadFile(json));
    for (const nlohmann::json& scene : manifest.at("scenes")) {
      SuiteScene read{scene.at("name"),
                      data / scene.at("path").get<std::string>(),
                      scene.value("key_view", ""),
                      scene.value("arguments", std::vector<std::string>())};
      if (!IsSafeRelativePath(read.name) || read.name.find('/') != std::string::npos) {
        throw InvalidArgument("{}: \"{}\" is not a name of a scene", json.string(), read.name);
      }
      if (fs::exists(read.folder)) {
        scenes.found.push_back(std::move(read));
      } else {
        scenes.missing.push_back(read.name);
      }
      ++entry;
    }
  } catch (const nlohmann::json::exception& e) {
    throw InvalidArgument("{}: scene {} cannot be read: {}", json.string(), entry, e.what());
  }
  return scenes;
}

fs::path SuiteTask::Results() const {
  return fs::path(scene.name) / preset.name / std::to_string(seed);
}

fs::path SuiteTask::ColorizerFile() const { return colorizer_of->Results() / artifact::kColorizer; }

std::vector<std::string> SuiteTask::Arguments(const fs::path& suite) const {
  const bool is_bound = preset.name == kBoundPreset;
  const std::string name = is_bound ? kDefaultPreset : preset.name;
  std::vector<std::string> arguments = {"colorize",
                                        scene.folder.string(),
                                        "-o",
                                        (suite / Results()).string(),
                                        "--benchmark",
                                        "--seed",
                                        std::to_string(seed),
                                        "--preset",
                                        preset.file.empty() ? name : preset.file.string()};
  if (!scene.key_view.empty() && !ChoosesKeyView(preset)) {
    arguments.insert(arguments.end(), {"--key-view", scene.key_view});
  }
  if (is_bound) arguments.push_back("--bound");
  for (const std::string& argument : preset.arguments) {
    arguments.push_back(argument.starts_with(kResultsPrefix) ? (suite / ColorizerFile()).string()
                                                             : argument);
  }
  arguments.insert(arguments.end(), scene.arguments.begin(), scene.arguments.end());
  return arguments;
}

std::vector<SuiteTask> PlanSuite(const std::vector<SuiteScene>& scenes,
                                 const std::vector<SuitePreset>& presets,
                                 int seeds,
                                 const ColorizerSources& sources) {
  std::vector<SuiteTask> tasks;
  for (int seed = 1; seed <= seeds; ++seed) {
    for (const SuiteScene& scene : scenes) {
      for (const SuitePreset& preset : presets) {
        SuiteTask task = TaskOf(scene, preset, static_cast<uint64_t>(seed));
        const auto [other_scene, other_preset] = SceneAndPresetOfColorizer(preset);
        if (!other_scene.empty()) {
          const auto source = std::ranges::find(sources.scenes, other_scene, &SuiteScene::name);
          if (other_scene == scene.name || source == sources.scenes.end()) continue;
          const auto taken = std::ranges::find(sources.presets, other_preset, &SuitePreset::name);
          if (taken == sources.presets.end()) {
            throw InvalidArgument("{} takes a colorizer of {}, which this machine does not have",
                                  preset.name,
                                  other_preset);
          }
          task.colorizer_of = std::make_shared<const SuiteTask>(TaskOf(*source, *taken, task.seed));
        }
        tasks.push_back(std::move(task));
      }
    }
  }
  return tasks;
}

std::vector<SuitePreset> SelectPresets(const std::vector<SuitePreset>& all,
                                       const std::vector<std::string>& names) {
  return Select(all, names, "preset");
}

std::vector<SuiteScene> SelectScenes(const SuiteScenes& all,
                                     const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (std::find(all.missing.begin(), all.missing.end(), name) != all.missing.end()) {
      throw InvalidArgument("the scene {} is not in the data folder of this machine", name);
    }
  }
  return Select(all.found, names, "scene");
}

}  // namespace color3d
