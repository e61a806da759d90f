// The runs of a suite: scenes of a manifest x presets of a table x seeds. Pure but for reading
// files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace color3d {

// A row of the table of baselines (tests/bench/baselines/README.md).
struct SuitePreset {
  std::string name;
  std::filesystem::path file;  // empty: a preset of the server
  std::string kind;            // ours, baseline, paper, ablation
  bool oracle = false;         // uses true colours that a user does not have
  std::string claim;           // one sentence
  // Further options of `color3d colorize`. After `--colorizer`, "results:SCENE/PRESET" is the
  // colorizer of that run, of the same seed.
  std::vector<std::string> arguments = {};
};

// The preset that others are compared with.
inline constexpr char kDefaultPreset[] = "fast";
// kDefaultPreset with `--bound`; its figure is the error of the bound.
inline constexpr char kBoundPreset[] = "bound";

// Reads the rows of a Markdown table "| name | file | kind | oracle | claim |"; options of `color3d
// colorize` may follow the file, as in "paper.textproto --keys 2". Throws
// Error{kInvalidArgument} with the line if one cannot be read or a file is missing.
std::vector<SuitePreset> ReadPresetTable(const std::filesystem::path& markdown);

struct SuiteScene {
  std::string name;
  std::filesystem::path folder;
  std::string key_view;                // empty: selected by the preset
  std::vector<std::string> arguments;  // further options of `color3d colorize`, e.g. --film
};

struct SuiteScenes {
  std::vector<SuiteScene> found;
  std::vector<std::string> missing;  // names of scenes without a folder on this machine
};

// Reads {"scenes": [{"name": ..., "path": ..., "key_view": ..., "arguments": [...]}]}; paths are
// relative to `data`. Throws Error{kInvalidArgument} with the entry that is wrong.
SuiteScenes ReadManifest(const std::filesystem::path& json, const std::filesystem::path& data);

// A run to do.
struct SuiteTask {
  SuiteScene scene;
  SuitePreset preset;
  uint64_t seed = 1;
  std::string options_digest;  // of all that decides the result but the program
  // The run whose colorizer this one uses; null: none.
  std::shared_ptr<const SuiteTask> colorizer_of = nullptr;

  // Arguments of `color3d`, with results in a folder of `suite`, the folder of the suite. A preset
  // with select_key_view or `--keys` chooses the key view itself.
  std::vector<std::string> Arguments(const std::filesystem::path& suite) const;
  // Folder of its results, relative to the folder of the suite.
  std::filesystem::path Results() const;
  // Where colorizer_of has the file, relative to the folder of the suite.
  std::filesystem::path ColorizerFile() const;
};

// The runs that others may take a colorizer from.
struct ColorizerSources {
  std::vector<SuiteScene> scenes;
  std::vector<SuitePreset> presets;
};

// Seed by seed, so that an interrupted suite has whole rows first. A preset with the colorizer of
// another run is left out for the scene of that run, and for all if that scene is not among
// `sources`. Throws Error{kInvalidArgument} if the preset of that run is not.
std::vector<SuiteTask> PlanSuite(const std::vector<SuiteScene>& scenes,
                                 const std::vector<SuitePreset>& presets,
                                 int seeds,
                                 const ColorizerSources& sources = {});

// Elements of `all` with these names, in their order; all if `names` is empty. Throws
// Error{kInvalidArgument} with an unknown name and the known ones.
std::vector<SuitePreset> SelectPresets(const std::vector<SuitePreset>& all,
                                       const std::vector<std::string>& names);
std::vector<SuiteScene> SelectScenes(const SuiteScenes& all, const std::vector<std::string>& names);

}  // namespace color3d
