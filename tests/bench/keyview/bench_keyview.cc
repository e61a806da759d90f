// color3d-bench keyview: view and time of each strategy, and the colour error of the other views
// when coloured from it by feature neighbours, compared with all other choices.
#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/base/files.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"
#include "core/scene/import/import.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct KeyViewArguments {
  std::vector<std::string> folders;
  bool as_one = false;
  int side_px = 256;
  int tests = 10;
  int keys = 1000;
  int threads = 2;
  std::string sheets;
  std::string json_file;
};

double Since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Scenes with their photos in one folder of links.
class SceneFolder {
 public:
  const fs::path& path() const { return scratch_.path(); }

  // Reads the photos below a folder as views without poses.
  void AddPhotos(const fs::path& folder, Scene* scene) {
    const fs::path photos = fs::exists(folder / "images") ? folder / "images" : folder;
    const std::string link = Link(photos);
    for (const std::string& name : ListFiles(photos)) {
      if (!HasImageExtension(name)) continue;
      View view;
      view.name = link + "/" + name;
      view.image_file = view.name;
      view.camera = view.captured_camera = {64, 48, 50.0, 50.0, 32.0, 24.0};
      scene->views.push_back(view);
    }
  }

  Scene Load(const fs::path& folder) {
    Scene scene;
    if (!fs::exists(folder / "sparse")) {
      AddPhotos(folder, &scene);
      return scene;
    }
    const ScratchFolder scratch;
    QuietRun run;
    scene = ImportScene(folder, scratch.path(), {}, run.control()).scene;
    const std::string link = Link(folder);
    for (View& view : scene.views) view.image_file = link + "/" + view.image_file;
    return scene;
  }

 private:
  std::string Link(const fs::path& folder) {
    const std::string name = std::to_string(links_++);
    fs::create_directory_symlink(fs::canonical(folder), scratch_.path() / name);
    return name;
  }
  const ScratchFolder scratch_;
  int links_ = 0;
};

// Returns `count` evenly spaced entries of `all`.
std::vector<int> Spread(int all, int count) {
  std::vector<int> chosen;
  const int taken = std::min(all, count);
  for (int i = 0; i < taken; ++i) chosen.push_back((2 * i + 1) * all / (2 * taken));
  return chosen;
}

class ErrorOfKeys {
 public:
  ErrorOfKeys(const Scene& scene, const fs::path& folder, const KeyViewArguments& args)
      : args_(args), encoder_(Encoder::Embedded()) {
    for (const View& view : scene.views) {
      truth_.push_back(LabFromSrgb(ReadImageWithin(folder / view.image_file, args.side_px)));
    }
    tests_ = Spread(static_cast<int>(truth_.size()), args.tests);
  }

  // Mean CIEDE2000 over the test views, coloured from view `key` by feature neighbours.
  double Of(int key) {
    const auto known = errors_.find(key);
    if (known != errors_.end()) return known->second;
    ColorizerOptions options;
    options.iterations = 0;
    options.max_side_px = args_.side_px;
    ThreadPool pool(args_.threads);
    NullObserver silent;
    NoCheckpoints none;
    const auto colorizer =
        TrainColorizer(encoder_,
                       {{"key view", LuminanceOfLab(truth_[key]), ChromaOfLab(truth_[key])}},
                       options,
                       {pool, none, silent, {}});
    double sum = 0.0;
    int count = 0;
    for (int test : tests_) {
      if (test == key) continue;
      const Image l = LuminanceOfLab(truth_[test]);
      sum += MeanDeltaE00(JoinLab(l, colorizer->Colorize(l)), truth_[test]);
      ++count;
    }
    return errors_[key] = count > 0 ? sum / count : 0.0;
  }

 private:
  const KeyViewArguments& args_;
  std::shared_ptr<const Encoder> encoder_;
  std::vector<Image> truth_;
  std::vector<int> tests_;
  std::map<int, double> errors_;
};

// Runs the stage as a job does. `work` holds inputs, outputs and the cache.
ordered_json Select(const Scene& scene,
                    const fs::path& folder,
                    KeyViewStrategy strategy,
                    const fs::path& work,
                    const KeyViewArguments& args,
                    double* seconds) {
  WriteFileAtomic(work / artifact::kScene, SceneToJson(scene));
  fs::create_directories(work / "out");
  NullObserver silent;
  NoCheckpoints none;
  CancellationToken cancel;
  StageContext::Setup setup;
  setup.scene_folder = folder;
  setup.inputs = {{artifact::kScene, work / artifact::kScene}};
  setup.output_folder = work / "out";
  setup.threads = args.threads;
  setup.cache_folder = work / "cache";
  StageContext context(setup, none, silent, cancel);
  SelectKeyViewOptions options;
  options.selection.strategy = strategy;
  const auto start = std::chrono::steady_clock::now();
  RunSelectKeyView(options, context);
  *seconds = Since(start);
  return ordered_json::parse(ReadFile(work / "out" / artifact::kKeyView));
}

ordered_json MeasureScene(const std::string& name,
                          const Scene& scene,
                          const fs::path& folder,
                          const KeyViewArguments& args) {
  const ScratchFolder scratch;
  std::optional<ErrorOfKeys> errors;
  if (args.tests > 0) errors.emplace(scene, folder, args);
  ordered_json result{{"scene", name}, {"views", scene.views.size()}};
  const std::pair<const char*, KeyViewStrategy> runs[] = {
      {"coverage, nothing cached", KeyViewStrategy::kCoverage},
      {"coverage", KeyViewStrategy::kCoverage},
      {"entropy", KeyViewStrategy::kEntropy},
      {"tracks", KeyViewStrategy::kTracks}};
  for (const auto& [label, strategy] : runs) {
    double seconds = 0.0;
    const ordered_json key = Select(scene, folder, strategy, scratch.path(), args, &seconds);
    const std::string view = key.at("view");
    int set_aside = 0;
    for (const auto& ranked : key.at("ranking")) set_aside += ranked.at("set_aside") ? 1 : 0;
    ordered_json run{{"strategy", label},
                     {"used", key.at("strategy")},
                     {"view", view},
                     {"decisiveness", key.at("decisiveness")},
                     {"set_aside", set_aside},
                     {"seconds", seconds}};
    if (errors) run["delta_e00"] = errors->Of(scene.FindView(view));
    result["runs"].push_back(run);
    if (!args.sheets.empty()) {
      fs::create_directories(args.sheets);
      WriteFileAtomic(
          fs::path(args.sheets) / (name + "-" + std::string(key.at("strategy")) + ".jpg"),
          ReadFile(scratch.path() / "out" / artifact::kKeyViewRanking));
    }
  }
  if (errors) {
    double sum = 0.0, best = 1e9, worst = 0.0;
    const std::vector<int> keys = Spread(static_cast<int>(scene.views.size()), args.keys);
    for (int key : keys) {
      const double error = errors->Of(key);
      sum += error;
      best = std::min(best, error);
      worst = std::max(worst, error);
    }
    result["all_choices"] = {{"keys", keys.size()},
                             {"best", best},
                             {"mean", sum / static_cast<double>(keys.size())},
                             {"worst", worst},
                             {"middle", errors->Of(static_cast<int>(scene.views.size()) / 2)}};
  }
  return result;
}

void RunKeyView(const KeyViewArguments& args) {
  ordered_json results = ordered_json::array();
  SceneFolder folder;
  Scene all;
  for (const std::string& name : args.folders) {
    if (args.as_one) {
      folder.AddPhotos(name, &all);
    } else {
      const Scene scene = folder.Load(name);
      results.push_back(MeasureScene(fs::path(name).filename(), scene, folder.path(), args));
    }
  }
  if (args.as_one) results.push_back(MeasureScene("all", all, folder.path(), args));
  WriteResult(results, args.json_file);
}

}  // namespace

void AddKeyViewCommand(CLI::App& app) {
  auto args = std::make_shared<KeyViewArguments>();
  CLI::App* command = app.add_subcommand(
      "keyview", "Compare the strategies of key view selection by time and error");
  command->add_option("--scene", args->folders, "Scene or folder of colour photos; may be repeated")
      ->required();
  command->add_flag(
      "--as-one", args->as_one, "Treat the photos of all folders as one scene without poses");
  command->add_option("--side", args->side_px, "Longer side of the coloured pictures, px");
  command->add_option("--tests", args->tests, "Number of views to colour and score; 0: none");
  command->add_option(
      "--keys", args->keys, "Number of other key views to compare with, evenly spread");
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_option("--sheets", args->sheets, "Folder for contact sheets");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] { RunKeyView(*args); });
}

}  // namespace color3d
