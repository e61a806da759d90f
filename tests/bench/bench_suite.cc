// color3d-bench suite: scenes x presets x seeds through the real client and a private server, which
// never sees a colour of held-out views. Resumable. Writes a table, a page and all rows.
#include <algorithm>
#include <cstdio>
#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/bench/commands.h"
#include "tests/bench/suite/suite_csv.h"
#include "tests/bench/suite/suite_page.h"
#include "tests/bench/suite/suite_plan.h"
#include "tests/bench/suite/suite_rows.h"
#include "tests/bench/suite/suite_runner.h"
#include "tests/bench/suite/suite_table.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

struct SuiteArguments {
  std::string manifest, data, table, out, commit, earlier;
  std::vector<std::string> scenes, presets, server_options;
  int seeds = 1;
  SuiteLimits limits;
  bool table_only = false, untimed = false;
};

// Adds commit and machine to every row, and takes seconds away if `untimed`.
class LabelledRunner : public TaskRunner {
 public:
  LabelledRunner(std::unique_ptr<TaskRunner> runner, std::string commit, bool untimed)
      : runner_(std::move(runner)),
        commit_(std::move(commit)),
        machine_(MachineName()),
        untimed_(untimed) {}
  SuiteRow Run(const SuiteTask& task, double limit_seconds) override {
    SuiteRow row = runner_->Run(task, limit_seconds);
    row.commit = commit_;
    row.machine = machine_;
    if (untimed_) row.metrics.erase("seconds_total");
    return row;
  }

 private:
  std::unique_ptr<TaskRunner> runner_;
  const std::string commit_, machine_;
  const bool untimed_;
};

void WriteTables(const SuiteArguments& args,
                 const std::vector<SuiteRow>& rows,
                 const std::vector<SuitePreset>& presets) {
  const fs::path out = args.out;
  const std::vector<SceneResults> scenes = SummarizeScenes(rows, presets);
  const std::vector<PresetSummary> summaries = SummarizePresets(scenes, presets);
  const std::vector<ClaimResult> claims = TestClaims(scenes);
  std::set<std::string> machines, commits;
  for (const SuiteRow& row : rows) {
    machines.insert(row.machine);
    if (!row.commit.empty()) commits.insert(row.commit);
  }
  std::string note = std::to_string(rows.size()) + " runs";
  for (const std::string& machine : machines) note += "; " + machine;
  for (const std::string& commit : commits) note += "; commit " + commit;
  const std::string markdown = SuiteMarkdown(scenes, summaries, claims);
  WriteFileAtomic(out / "results.csv", RowsToCsv(rows));
  WriteFileAtomic(out / "table.md", note + ".\n\n" + markdown);
  WriteFileAtomic(out / "index.html", SuitePage(scenes, summaries, claims, note + "."));
  std::printf("%s", markdown.c_str());
}

void RunSuite(const SuiteArguments& args) {
  const SuiteScenes scenes = ReadManifest(args.manifest, args.data);
  for (const std::string& name : scenes.missing) {
    std::fprintf(stderr, "%s: not in %s, left out\n", name.c_str(), args.data.c_str());
  }
  const std::vector<SuitePreset> table = ReadPresetTable(args.table);
  const std::vector<SuitePreset> presets = SelectPresets(table, args.presets);
  const std::vector<SuiteTask> tasks =
      PlanSuite(SelectScenes(scenes, args.scenes), presets, args.seeds, {scenes.found, table});
  for (const SuitePreset& preset : presets) {
    if (std::ranges::find(tasks, preset.name, [](const SuiteTask& t) { return t.preset.name; }) ==
        tasks.end()) {
      std::fprintf(stderr, "%s: there is no scene for it here, left out\n", preset.name.c_str());
    }
  }
  if (tasks.empty()) {
    throw InvalidArgument(
        "there is nothing to run: no scene of {} is in {}", args.manifest, args.data);
  }
  fs::create_directories(args.out);
  const fs::path jsonl = fs::path(args.out) / "results.jsonl";
  if (!args.earlier.empty()) AddMissingRows(jsonl, RowsFromCsv(ReadFile(args.earlier)));
  int left = 0;
  if (!args.table_only) {
    const CancellationToken never;
    left = RunTasks(tasks, args.limits, jsonl, [&]() -> std::unique_ptr<TaskRunner> {
      const fs::path programs = fs::read_symlink("/proc/self/exe").parent_path();
      return std::make_unique<LabelledRunner>(
          std::make_unique<ClientRunner>(programs, args.out, args.server_options, never),
          args.commit,
          args.untimed);
    });
  }
  WriteTables(args, NewestRows(ReadRows(jsonl)), table);
  if (left > 0) {
    std::fprintf(stderr, "%d runs are left; repeat the command to go on\n", left);
  }
}

}  // namespace

void AddSuiteCommand(CLI::App& app) {
  auto args = std::make_shared<SuiteArguments>();
  CLI::App* command = app.add_subcommand(
      "suite", "Run presets and baselines on several scenes, resumable, and tabulate the results");
  command->add_option("--manifest", args->manifest, "Scenes (JSON), e.g. tests/bench/suite.json")
      ->required()
      ->check(CLI::ExistingFile);
  command->add_option("--data", args->data, "Folder that the paths of the manifest begin in")
      ->required()
      ->check(CLI::ExistingDirectory);
  command
      ->add_option("--table",
                   args->table,
                   "Table of presets (Markdown), e.g. tests/bench/baselines/README.md")
      ->required()
      ->check(CLI::ExistingFile);
  command
      ->add_option("--out",
                   args->out,
                   "Folder for results.jsonl, results.csv, table.md, index.html and the runs")
      ->required();
  command->add_option("--scenes", args->scenes, "Names of scenes; default: all of the manifest");
  command->add_option("--presets", args->presets, "Names of presets; default: all of the table");
  command->add_option("--seeds", args->seeds, "Number of seeds")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command
      ->add_option("--budget",
                   args->limits.budget_seconds,
                   "Time for all runs, e.g. 90s, 30m, 2h; default: no limit")
      ->transform(
          CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"m", 60}, {"h", 3600}}));
  command->add_option("--timeout", args->limits.run_seconds, "Time limit of a run, s")
      ->capture_default_str();
  command->add_flag("--retry-failed", args->limits.retry_failed, "Repeat the runs that failed");
  command->add_option(
      "--server", args->server_options, "Further options of `color3d-server serve`, e.g. --model");
  command->add_option("--commit", args->commit, "Commit that the rows state");
  command
      ->add_option("--earlier",
                   args->earlier,
                   "results.csv of an earlier suite; its runs are not repeated, its rows are kept")
      ->check(CLI::ExistingFile);
  command->add_flag("--untimed",
                    args->untimed,
                    "Leave seconds out of the new rows: other programs run beside them");
  command->add_flag("--table-only", args->table_only, "Only write the tables of existing rows");
  command->callback([args] { RunSuite(*args); });
}

}  // namespace color3d
