// The presets of tests/bench/baselines and their table.
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "core/base/files.h"
#include "server/planning/planner.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

const fs::path kFolder = fs::path(COLOR3D_SOURCE_DIR) / "tests/bench/baselines";

// File by name, as in the table. Options of the client may follow the file.
std::map<std::string, std::string> FilesOfTable() {
  const std::string table = ReadFile(kFolder / "README.md");
  const std::regex row(
      "\\n\\| ([a-z0-9_]+) \\| ((?:[a-z0-9_]+\\.textproto|-)(?: --[^|]+)?) \\| "
      "(ours|baseline|paper|ablation) \\| (yes|no) \\| [^|]+ \\|(?=\\n)");
  std::map<std::string, std::string> files;
  for (std::sregex_iterator it(table.begin(), table.end(), row), end; it != end; ++it) {
    if ((*it)[1] != "name") files[(*it)[1]] = (*it)[2];
  }
  // Each line of the table but its header is such a row.
  const std::regex line("\\n\\|(?! name |---)");
  EXPECT_EQ(std::distance(std::sregex_iterator(table.begin(), table.end(), line), {}),
            std::ssize(files));
  return files;
}

v1::JobSpec SpecOfPreset(const fs::path& file) {
  v1::JobSpec spec = SceneSpec();
  v1::ColorizeSceneSpec preset;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(ReadFile(file), &preset)) << file;
  spec.mutable_colorize_scene()->MergeFrom(preset);
  return spec;
}

// The options of all stages that run.
std::set<std::string> WorkOf(const v1::JobSpec& spec) {
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  std::set<std::string> work;
  for (const NewJob& job : graph.jobs) {
    if (job.kind != "colorize_scene" && job.skip_reason.empty()) work.insert(job.spec);
  }
  return work;
}

TEST(BaselinePresetsTest, EachFileHasOneRow) {
  std::set<std::string> listed;
  for (const auto& [name, file] : FilesOfTable()) {
    if (file[0] == '-') continue;
    const size_t options = file.find(' ');
    if (options == std::string::npos) {
      EXPECT_EQ(file, name + ".textproto");
    }
    listed.insert(file.substr(0, options));
  }
  std::set<std::string> present;
  for (const fs::directory_entry& entry : fs::directory_iterator(kFolder)) {
    if (entry.path().extension() == ".textproto") present.insert(entry.path().filename().string());
  }
  EXPECT_EQ(listed, present);
}

TEST(BaselinePresetsTest, EachIsWorkOfItsOwn) {
  std::map<std::set<std::string>, std::string> seen;
  for (const v1::Preset preset : {v1::PRESET_FAST, v1::PRESET_BEST, v1::PRESET_PAPER}) {
    v1::JobSpec spec = SceneSpec();
    spec.mutable_colorize_scene()->set_preset(preset);
    seen[WorkOf(spec)] = v1::Preset_Name(preset);
  }
  for (const auto& [name, file] : FilesOfTable()) {
    if (file[0] == '-' || file.find(' ') != std::string::npos) continue;
    const auto [other, is_new] = seen.emplace(WorkOf(SpecOfPreset(kFolder / file)), name);
    EXPECT_TRUE(is_new) << name << " does the same as " << other->second;
  }
}

}  // namespace
}  // namespace color3d
