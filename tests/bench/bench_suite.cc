// color3d-bench suite: runs scenes x variants of `color3d-bench pipeline`, each in its own process,
// so that a crash costs one run. Resumable. Prints a table at the end.
#include <algorithm>
#include <cstdio>
#include <set>
#include <sstream>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/process/subprocess.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/commands.h"
#include "tests/bench/suite_results.h"

namespace color3d {
namespace {

struct SuiteArguments {
  std::vector<std::string> scenes;
  std::vector<std::string> variants;  // NAME or NAME=ARGUMENTS
  std::string common;
  std::string out_folder;
  std::string baseline;
  int timeout_seconds = 3600;
  bool table_only = false;
};

std::vector<std::string> Words(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

// "{scene}" stands for the scene's name.
std::string WithScene(std::string word, const std::string& scene_name) {
  constexpr std::string_view kPlace = "{scene}";
  for (size_t at = 0; (at = word.find(kPlace, at)) != std::string::npos; at += scene_name.size()) {
    word.replace(at, kPlace.size(), scene_name);
  }
  return word;
}

std::vector<SuiteRun> PlannedRuns(const SuiteArguments& args) {
  std::vector<SuiteRun> runs;
  std::set<std::string> names;
  for (const std::string& scene : args.scenes) {
    if (const SuiteRun named{scene}; !names.insert(named.SceneName()).second) {
      throw InvalidArgument("two scenes are named " + named.SceneName() +
                            "; their results would overwrite each other: rename a folder");
    }
    for (const std::string& text : args.variants) {
      SuiteRun run;
      run.scene = scene;
      const size_t end = text.find('=');
      run.variant = text.substr(0, end);
      if (!IsSafeRelativePath(run.variant) || run.variant.find('/') != std::string::npos) {
        throw InvalidArgument("\"" + text + "\" is not a variant; give NAME or NAME=OPTIONS");
      }
      run.arguments = Words(args.common);
      if (end != std::string::npos) {
        for (std::string& word : Words(text.substr(end + 1))) {
          run.arguments.push_back(std::move(word));
        }
      }
      for (std::string& word : run.arguments) word = WithScene(word, run.SceneName());
      runs.push_back(std::move(run));
    }
  }
  return runs;
}

// Returns false if the run failed; its log has the reason.
bool RunOne(const SuiteArguments& args, SuiteRun* run) {
  const std::filesystem::path folder =
      std::filesystem::path(args.out_folder) / run->SceneName() / run->variant;
  std::filesystem::create_directories(folder);
  std::filesystem::remove(folder / artifact::kMetrics);  // of an earlier run
  SubprocessOptions child;
  child.arguments = {std::filesystem::read_symlink("/proc/self/exe").string(),
                     "pipeline",
                     "--scene",
                     run->scene,
                     "--out",
                     folder.string()};
  child.arguments.insert(child.arguments.end(), run->arguments.begin(), run->arguments.end());
  child.log_path = folder / "log.txt";
  child.timeout = std::chrono::seconds(args.timeout_seconds);
  const SubprocessResult result = RunSubprocess(child, CancellationToken());
  run->seconds = result.seconds;
  if (result.exit_code != 0 || !std::filesystem::exists(folder / artifact::kMetrics)) {
    std::fprintf(stderr,
                 "%s, %s: failed with code %d after %.0f s, see %s\n",
                 run->scene.c_str(),
                 run->variant.c_str(),
                 result.exit_code,
                 result.seconds,
                 child.log_path.c_str());
    return false;
  }
  run->metrics = nlohmann::ordered_json::parse(ReadFile(folder / artifact::kMetrics));
  std::fprintf(
      stderr, "%s, %s: %.0f s\n", run->scene.c_str(), run->variant.c_str(), result.seconds);
  return true;
}

void RunSuite(const SuiteArguments& args) {
  std::filesystem::create_directories(args.out_folder);
  const std::filesystem::path jsonl = std::filesystem::path(args.out_folder) / "results.jsonl";
  const std::vector<SuiteRun> finished = ReadSuiteResults(jsonl);
  std::vector<SuiteRun> shown;
  int failed = 0;
  for (SuiteRun& run : PlannedRuns(args)) {
    const auto earlier = std::find_if(
        finished.begin(), finished.end(), [&](const SuiteRun& f) { return f.SameWork(run); });
    if (earlier != finished.end()) {
      shown.push_back(*earlier);
    } else if (args.table_only) {
      continue;
    } else if (RunOne(args, &run)) {
      AppendSuiteResult(jsonl, run);
      shown.push_back(std::move(run));
    } else {
      ++failed;
    }
  }
  const std::string table = SuiteTable(shown, args.baseline);
  WriteFileAtomic(std::filesystem::path(args.out_folder) / "table.md", table);
  std::printf("%s", table.c_str());
  if (failed > 0) {
    throw Error(ErrorCode::kAborted,
                std::to_string(failed) + " runs failed; repeat the command to retry them");
  }
}

}  // namespace

void AddSuiteCommand(CLI::App& app) {
  auto args = std::make_shared<SuiteArguments>();
  CLI::App* command = app.add_subcommand(
      "suite", "Run variants of `pipeline` on several scenes, resumable, and tabulate the results");
  command->add_option("--scene", args->scenes, "Folders of photos")->required();
  command
      ->add_option("--variant",
                   args->variants,
                   "Variant: NAME or NAME=OPTIONS of `pipeline`, e.g. \"paper=--paper\"; {scene} "
                   "in it stands for the name of the scene. May be repeated")
      ->required();
  command->add_option("--common", args->common, "Options of all variants, e.g. \"--bound\"");
  command
      ->add_option(
          "--out", args->out_folder, "Folder for results.jsonl, table.md and SCENE/VARIANT/")
      ->required();
  command->add_option("--baseline", args->baseline, "Variant that ratios refer to");
  command->add_option("--timeout", args->timeout_seconds, "Time limit of a run, s")
      ->capture_default_str();
  command->add_flag("--table-only", args->table_only, "Only print the table of existing results");
  command->callback([args] { RunSuite(*args); });
}

}  // namespace color3d
