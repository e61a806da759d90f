#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <sstream>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/bench/suite/suite_csv.h"
#include "tests/bench/suite/suite_page.h"
#include "tests/bench/suite/suite_plan.h"
#include "tests/bench/suite/suite_rows.h"
#include "tests/bench/suite/suite_runner.h"
#include "tests/bench/suite/suite_table.h"

namespace color3d {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

SuitePreset PresetOf(const std::string& name,
                     const std::string& kind = "baseline",
                     bool oracle = false) {
  return {name, {}, kind, oracle, "It helps."};
}

SuiteRow RowOf(const std::string& scene, const std::string& preset, double error, double seconds) {
  SuiteRow row{scene, preset, 1, "digest"};
  row.wall_seconds = seconds + 2.0;
  row.machine = "a machine, 2 cores";
  row.metrics = {{kRankingMetric, error}, {"delta_e00_gray", 10.0}, {"seconds_total", seconds}};
  return row;
}

std::string MessageOf(const std::function<void()>& run) {
  try {
    run();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

class SuitePlanTest : public testing::Test {
 protected:
  std::filesystem::path Write(const std::string& name, const std::string& text) {
    WriteFileAtomic(folder_.path() / name, text);
    return folder_.path() / name;
  }
  ScratchFolder folder_;
};

TEST_F(SuitePlanTest, ReadsTableOfPresets) {
  Write("gray.textproto", "");
  const auto table =
      Write("README.md",
            "# Title\n| name | file | kind | oracle | claim |\n|---|---|---|---|---|\n"
            "| fast | - | ours | no | Best. |\n| gray | gray.textproto | baseline | no | C. |\n"
            "| bound | - | baseline | yes | B. |\n"
            "| two_keys | gray.textproto --keys 2 | ours | no | K. |\n");
  const std::vector<SuitePreset> presets = ReadPresetTable(table);
  ASSERT_EQ(presets.size(), 4u);
  EXPECT_TRUE(presets[0].file.empty());
  EXPECT_EQ(presets[1].file, folder_.path() / "gray.textproto");
  EXPECT_TRUE(presets[2].oracle);
  EXPECT_EQ(presets[2].claim, "B.");
  EXPECT_TRUE(presets[1].arguments.empty());
  const auto tasks = PlanSuite({{"fern", folder_.path(), "7"}}, {presets[1], presets[3]}, 1);
  EXPECT_THAT(tasks[0].Arguments("out"), testing::Contains("--key-view"));
  EXPECT_THAT(tasks[1].Arguments("out"), testing::Contains("--keys"));
  EXPECT_THAT(tasks[1].Arguments("out"), Not(testing::Contains("--key-view")));
  EXPECT_NE(tasks[0].options_digest, tasks[1].options_digest);
  Write("gray.textproto", "# random\nselect_key_view {\n}\n");
  EXPECT_THAT(tasks[0].Arguments("out"), Not(testing::Contains("--key-view")));
  EXPECT_THAT(MessageOf([&] { SelectPresets(presets, {"paper"}); }),
              HasSubstr("there is no preset paper; there are fast, gray, bound, two_keys"));
}

TEST_F(SuitePlanTest, RefusesTableWithMissingFileOrCell) {
  EXPECT_THAT(MessageOf([&] {
                ReadPresetTable(Write("a.md", "| x | none.textproto | ours | no | c |\n"));
              }),
              HasSubstr("a.md:1: there is no file"));
  EXPECT_THAT(
      MessageOf([&] { ReadPresetTable(Write("b.md", "\n| x | - | ours | maybe | c |\n")); }),
      HasSubstr("b.md:2: expected"));
  EXPECT_THAT(MessageOf([&] { ReadPresetTable(Write("c.md", "nothing")); }), HasSubstr("no table"));
}

TEST_F(SuitePlanTest, ListsMissingScenesAndNamesWrongEntry) {
  std::filesystem::create_directories(folder_.path() / "scenes/fern");
  const auto manifest =
      Write("suite.json",
            R"({"scenes": [{"name": "fern", "path": "scenes/fern", "key_view": "7"},
                                             {"name": "fox", "path": "scenes/fox"}]})");
  const SuiteScenes scenes = ReadManifest(manifest, folder_.path());
  ASSERT_EQ(scenes.found.size(), 1u);
  EXPECT_THAT(scenes.missing, ElementsAre("fox"));
  EXPECT_THAT(MessageOf([&] { SelectScenes(scenes, {"fox"}); }),
              HasSubstr("fox is not in the data"));
  const auto tasks = PlanSuite(scenes.found, {PresetOf("fast"), PresetOf(kBoundPreset)}, 2);
  ASSERT_EQ(tasks.size(), 4u);
  EXPECT_THAT(tasks[0].Arguments("out"), Not(testing::Contains("--bound")));
  const std::vector<std::string> arguments = tasks[1].Arguments("out");
  EXPECT_THAT(arguments, testing::Contains("--bound"));
  EXPECT_THAT(arguments, testing::Contains("fast"));
  EXPECT_THAT(arguments, testing::Contains("7"));
  EXPECT_THAT(MessageOf([&] {
                ReadManifest(Write("bad.json", R"({"scenes": [{"name": "a"}]})"), folder_.path());
              }),
              HasSubstr("scene 0 cannot be read"));
}

TEST_F(SuitePlanTest, DigestChangesWithPresetFileAndKeyView) {
  SuitePreset preset = PresetOf("gray");
  preset.file = Write("gray.textproto", "a");
  SuiteScene scene{"fern", folder_.path()};
  const std::string before = PlanSuite({scene}, {preset}, 1)[0].options_digest;
  Write("gray.textproto", "b");
  const std::string other_file = PlanSuite({scene}, {preset}, 1)[0].options_digest;
  EXPECT_NE(other_file, before);
  scene.key_view = "7";
  EXPECT_NE(PlanSuite({scene}, {preset}, 1)[0].options_digest, other_file);
}

TEST_F(SuitePlanTest, ColorizerOfAnotherRunIsItsFile) {
  SuitePreset transfer = PresetOf("transfer");
  transfer.arguments = {"--colorizer", "results:fox/fast"};
  const std::vector<SuiteScene> scenes = {{"fern", "f"}, {"fox", "g"}};
  const auto tasks =
      PlanSuite(scenes, {transfer, PresetOf("fast")}, 2, {scenes, {transfer, PresetOf("fast")}});
  ASSERT_EQ(tasks.size(), 6u) << "fox has no transfer from itself";
  EXPECT_THAT(tasks[0].Arguments("out"), testing::Contains("out/fox/fast/1/colorizer.c3c"));
  EXPECT_THAT(tasks[3].Arguments("out"), testing::Contains("out/fox/fast/2/colorizer.c3c"));
  EXPECT_EQ(tasks[0].colorizer_of->options_digest, tasks[2].options_digest);
  EXPECT_THAT(MessageOf([&] {
                PlanSuite(scenes, {transfer}, 1, {scenes, {}});
              }),
              HasSubstr("transfer takes a colorizer of fast, which this machine does not have"));
  EXPECT_TRUE(PlanSuite(scenes, {transfer}, 1, {{scenes[0]}, {}}).empty()) << "fox is not here";
}

TEST_F(SuitePlanTest, RowsSurviveHalfLine) {
  const auto file = folder_.path() / "results.jsonl";
  EXPECT_TRUE(ReadRows(file).empty());
  SuiteRow first = RowOf("fern", "fast", 2.0, 50.0);
  first.view_errors = {{"a", 1.0}, {"b", 3.0}};
  AppendRow(file, first);
  WriteFileAtomic(file, ReadFile(file) + "{\"scene\": \"fo");
  AppendRow(file, RowOf("fox", "fast", 3.0, 60.0));
  AppendRow(file, RowOf("fox", "fast", 4.0, 70.0));
  const std::vector<SuiteRow> rows = ReadRows(file);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].view_errors, first.view_errors);
  EXPECT_EQ(rows[1].Metric(kRankingMetric), 4.0) << "the later row counts";
  EXPECT_TRUE(std::isnan(rows[1].Metric("psnr_l")));
}

// Ends like a killed process after some runs, in the middle of writing a row.
class FakeRunner : public TaskRunner {
 public:
  FakeRunner(int runs, std::filesystem::path jsonl, std::set<std::string> failing)
      : runs_(runs), jsonl_(std::move(jsonl)), failing_(std::move(failing)) {}
  SuiteRow Run(const SuiteTask& task, double) override {
    if (runs_-- == 0) {
      const std::string rows = std::filesystem::exists(jsonl_) ? ReadFile(jsonl_) : "";
      WriteFileAtomic(jsonl_, rows + "{\"scene\": \"half");
      throw Error(ErrorCode::kCancelled, "killed");
    }
    SuiteRow row = RowOf(task.scene.name,
                         task.preset.name,
                         static_cast<double>(task.preset.name.size() + task.seed),
                         10.0);
    row.seed = task.seed;
    row.options_digest = task.options_digest;
    if (failing_.contains(task.preset.name)) row.failure = "exit code 1";
    return row;
  }

 private:
  int runs_;
  std::filesystem::path jsonl_;
  std::set<std::string> failing_;
};

class RunTasksTest : public testing::Test {
 protected:
  RunTasksTest() : presets_{PresetOf("fast"), PresetOf("flow"), PresetOf("automatic")} {
    tasks_ = PlanSuite({{"fern", "f"}, {"fox", "g"}}, presets_, 2);
  }
  int Run(const std::string& name,
          const SuiteLimits& limits,
          int runs = 1000,
          std::set<std::string> failing = {}) {
    const auto jsonl = folder_.path() / name;
    return RunTasks(
        tasks_, limits, jsonl, [&] { return std::make_unique<FakeRunner>(runs, jsonl, failing); });
  }
  std::string Table(const std::string& name) {
    const auto scenes = SummarizeScenes(NewestRows(ReadRows(folder_.path() / name)), presets_);
    return SuiteMarkdown(scenes, SummarizePresets(scenes, presets_), TestClaims(scenes));
  }
  ScratchFolder folder_;
  std::vector<SuitePreset> presets_;
  std::vector<SuiteTask> tasks_;
};

TEST_F(RunTasksTest, KilledThreeTimesGivesSameTable) {
  EXPECT_EQ(Run("whole", {}), 0);
  for (const int runs : {3, 1, 4}) EXPECT_THROW(Run("killed", {}, runs), Error);
  EXPECT_EQ(ReadRows(folder_.path() / "killed").size(), 8u);
  EXPECT_EQ(Run("killed", {}), 0);
  EXPECT_EQ(ReadRows(folder_.path() / "killed").size(), tasks_.size());
  EXPECT_EQ(Table("killed"), Table("whole"));
}

TEST_F(RunTasksTest, GoesOnFromRowsOfAnotherMachine) {
  EXPECT_EQ(Run("whole", {}), 0);
  EXPECT_THROW(Run("first", {}, 5), Error);
  const std::string csv = RowsToCsv(ReadRows(folder_.path() / "first"));
  AddMissingRows(folder_.path() / "second", RowsFromCsv(csv));
  AddMissingRows(folder_.path() / "second", RowsFromCsv(csv));
  EXPECT_EQ(ReadRows(folder_.path() / "second").size(), 5u);
  SuiteRow of_other_options = ReadRows(folder_.path() / "first").front();
  of_other_options.options_digest = "other";
  AddMissingRows(folder_.path() / "second", {of_other_options});
  EXPECT_EQ(ReadRows(folder_.path() / "second").size(), 5u) << "the row that is there counts";
  EXPECT_EQ(Run("second", {}, static_cast<int>(tasks_.size()) - 5), 0) << "runs only what is open";
  EXPECT_EQ(Table("second"), Table("whole"));
}

TEST_F(RunTasksTest, RefusesBudgetBelowShortestRunAndStartsNoneBeyondIt) {
  EXPECT_THROW(Run("rows", {}, 3), Error);  // fern: 12 s each
  EXPECT_THAT(MessageOf([&] { Run("rows", {.budget_seconds = 5.0}); }),
              HasSubstr("a budget of 5 s is below the shortest open run, 12 s"));
  EXPECT_EQ(Run("rows", {.budget_seconds = 12.0}), 9) << "each takes longer than what is left";
}

TEST_F(RunTasksTest, FailedRunIsRowAndRetriedOnRequestOnly) {
  EXPECT_EQ(Run("rows", {}, 1000, {"flow"}), 0);
  EXPECT_THAT(Table("rows"), HasSubstr("| flow | baseline | failed |"));
  EXPECT_EQ(Run("rows", {}, 0), 0) << "nothing is run again";
  EXPECT_EQ(Run("rows", {.retry_failed = true}), 0);
  EXPECT_THAT(Table("rows"), Not(HasSubstr("failed")));
}

TEST(SuiteTableTest, SortsCellsAndFindsFrontierWithKnee) {
  const std::vector<SuitePreset> presets = {PresetOf("fast", "ours"),
                                            PresetOf("slow"),
                                            PresetOf("quick"),
                                            PresetOf("poor"),
                                            PresetOf(kBoundPreset, "baseline", true)};
  SuiteRow bound = RowOf("fern", kBoundPreset, 2.0, 12.0);
  bound.metrics["delta_e00_chroma_bound"] = 1.0;
  const auto scenes = SummarizeScenes({RowOf("fern", "fast", 2.0, 10.0),
                                       bound,
                                       RowOf("fern", "slow", 1.9, 100.0),
                                       RowOf("fern", "quick", 6.0, 1.0),
                                       RowOf("fern", "poor", 7.0, 20.0)},
                                      presets);
  ASSERT_EQ(scenes.size(), 1u);
  std::vector<std::string> names;
  for (const SuiteCell& cell : scenes[0].cells) names.push_back(cell.preset.name);
  EXPECT_THAT(names, ElementsAre("slow", "fast", "quick", "poor", "bound"));
  EXPECT_THAT(scenes[0].frontier, ElementsAre(2, 1, 0)) << "by time, without poor and bound";
  EXPECT_EQ(scenes[0].knee, 1);
  EXPECT_EQ(scenes[0].gray, 10.0);
  const auto summaries = SummarizePresets(scenes, presets);
  EXPECT_EQ(summaries[0].preset.name, "bound");
  EXPECT_NEAR(summaries[0].error_ratio, 0.5, 1e-9);
  EXPECT_EQ(summaries[1].preset.name, "slow");
  EXPECT_NEAR(summaries[1].error_ratio, 0.95, 1e-9);
  EXPECT_NEAR(summaries[1].time_ratio, 10.0, 1e-9);
}

// Number of cells of each line of the table that holds `text`.
std::set<size_t> CellsOfTable(const std::string& markdown, const std::string& text) {
  const size_t at = markdown.find(text);
  std::istringstream lines(markdown.substr(markdown.rfind('\n', at) + 1));
  std::set<size_t> cells;
  for (std::string line; std::getline(lines, line) && line.starts_with('|');) {
    cells.insert(static_cast<size_t>(std::ranges::count(line, '|')) - 1);
  }
  return cells;
}

TEST(SuiteTableTest, MarkdownRowsHaveTheCellsOfTheirHeader) {
  const std::vector<SuitePreset> presets = {PresetOf("fast", "ours"), PresetOf("flow")};
  SuiteRow failed = RowOf("fern", "flow", 2.0, 10.0);
  failed.failure = "exit code 1";
  const auto scenes = SummarizeScenes({RowOf("fern", "fast", 2.0, 10.0), failed}, presets);
  const std::string markdown =
      SuiteMarkdown(scenes, SummarizePresets(scenes, presets), TestClaims(scenes));
  ASSERT_THAT(markdown, HasSubstr("failed"));
  for (const char* header : {"| preset | kind | scenes", "PSNR of L", "| claim |"}) {
    EXPECT_EQ(CellsOfTable(markdown, header).size(), 1u) << header;
  }
}

TEST(SuiteTableTest, IntervalCoversViewsAndSeeds) {
  SuiteRow one = RowOf("fern", "fast", 2.0, 10.0), two = one;
  one.view_errors = {{"a", 1.0}, {"b", 3.0}};
  two.seed = 2;
  two.view_errors = {{"a", 1.2}, {"b", 2.8}};
  const auto scenes = SummarizeScenes({one, two}, {PresetOf("fast")});
  const MeanWithInterval& error = scenes[0].cells[0].error;
  EXPECT_DOUBLE_EQ(error.mean, 2.0);
  EXPECT_LT(error.low, 1.5);
  EXPECT_GT(error.high, 2.5);
  SuiteRow three = RowOf("fern", "fast", 2.6, 10.0);  // without scores by view
  three.seed = 3;
  const auto with_three = SummarizeScenes({one, two, three}, {PresetOf("fast")});
  const MeanWithInterval& shifted = with_three[0].cells[0].error;
  EXPECT_NEAR(shifted.mean, 2.2, 1e-9);
  EXPECT_NEAR(shifted.high - shifted.mean, error.high - error.mean, 1e-9);
}

TEST(SuiteTableTest, ClaimsHoldDoNotHoldOrAreNotTested) {
  std::vector<SuiteRow> rows;
  for (const char* scene : {"fern", "fox"}) {
    rows.push_back(RowOf(scene, "paper_short", 2.0, 10.0));
    rows.push_back(RowOf(scene, "flow", 4.0, 10.0));
    rows.push_back(RowOf(scene, "paper_random_key", 1.5, 10.0));
    rows.push_back(RowOf(scene, "paper_no_generated", 2.01, 10.0));
  }
  const std::vector<SuitePreset> presets = {PresetOf("paper_short"),
                                            PresetOf("flow"),
                                            PresetOf("paper_random_key"),
                                            PresetOf("paper_no_generated")};
  std::map<std::string, std::string> verdicts;
  for (const ClaimResult& result : TestClaims(SummarizeScenes(rows, presets))) {
    verdicts[result.claim.worse] = result.verdict;
  }
  EXPECT_EQ(verdicts.at("flow"), "holds");
  EXPECT_EQ(verdicts.at("paper_random_key"), "does not hold");
  EXPECT_EQ(verdicts.at("paper_no_generated"), "no difference");
  EXPECT_EQ(verdicts.at("paper_rgb"), "not run");
  EXPECT_EQ(verdicts.at(""), "cannot be tested");
}

TEST(SuiteCsvTest, KeepsAllThatTheTablesNeed) {
  const std::vector<SuitePreset> presets = {PresetOf("fast"), PresetOf("flow"), PresetOf("gray")};
  SuiteRow timed = RowOf("fern", "fast", 2.0, 10.0);
  timed.view_errors = {{"a view", 1.5}, {"b=1", 2.5}};
  SuiteRow failed = RowOf("fern", "flow", 3.0, 10.0);
  failed.failure = "exit code 1: no \"a\", no b\nand c";
  SuiteRow untimed = RowOf("fern", "gray", 10.0, 10.0);
  untimed.seed = 2;
  untimed.metrics.erase("seconds_total");
  const std::vector<SuiteRow> rows = {timed, failed, untimed};
  const std::vector<SuiteRow> read = RowsFromCsv(RowsToCsv(rows));
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[0].view_errors, timed.view_errors);
  EXPECT_EQ(read[1].failure, "exit code 1: no \"a\", no b and c");
  EXPECT_TRUE(std::isnan(read[2].Metric("seconds_total")));
  EXPECT_EQ(read[2].options_digest, "digest");
  EXPECT_EQ(RowsToCsv(read), RowsToCsv(rows));
  const auto markdown = [&](const std::vector<SuiteRow>& of) {
    return SuiteMarkdown(SummarizeScenes(of, presets), {}, {});
  };
  EXPECT_THAT(markdown(read), HasSubstr("| 2.00 (1.50 to 2.50) |"));
  EXPECT_THAT(markdown(read), HasSubstr("exit code 1"));
}

TEST(SuiteCsvTest, NamesLineThatIsNoRow) {
  const std::string csv = RowsToCsv({RowOf("fern", "fast", 2.0, 10.0)});
  EXPECT_THAT(MessageOf([&] { RowsFromCsv(csv + "fern,flow,two\n"); }), HasSubstr("line 3 is not"));
  EXPECT_THAT(MessageOf([&] { RowsFromCsv("a,b\n1,2\n"); }), HasSubstr("line 2 is not"));
}

TEST(SuitePageTest, IsSmallSelfContainedAndEscaped) {
  SuitePreset preset = PresetOf("fast", "ours");
  preset.claim = "a < b";
  const auto scenes = SummarizeScenes({RowOf("fern", "fast", 2.0, 10.0)}, {preset});
  const std::string page =
      SuitePage(scenes, SummarizePresets(scenes, {preset}), TestClaims(scenes), "1 run");
  EXPECT_LT(page.size(), 300'000u);
  EXPECT_THAT(page, HasSubstr("a &lt; b"));
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, Not(HasSubstr(">nan")));
}

}  // namespace
}  // namespace color3d
