#include "tests/bench/suite_results.h"

#include <gtest/gtest.h>

#include "core/base/files.h"

namespace color3d {
namespace {

SuiteRun RunOf(const std::string& scene, const std::string& variant, double error, double seconds) {
  return {scene,
          variant,
          {"--variant-of", variant},
          seconds + 1.0,
          {{"delta_e00_chroma_2d", error},
           {"seconds_total", seconds},
           {"seconds_personalize", seconds / 2}}};
}

TEST(SuiteResults, SurviveKillInMiddleOfLine) {
  const ScratchFolder folder;
  const auto file = folder.path() / "results.jsonl";
  EXPECT_TRUE(ReadSuiteResults(file).empty());
  AppendSuiteResult(file, RunOf("data/fern", "fast", 3.0, 50.0));
  WriteFileAtomic(file, ReadFile(file) + "{\"scene\": \"data/fo");
  AppendSuiteResult(file, RunOf("data/fern", "fast", 2.0, 60.0));
  AppendSuiteResult(file, RunOf("data/fox/", "fast", 4.0, 70.0));
  const auto runs = ReadSuiteResults(file);
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].metrics.at("delta_e00_chroma_2d"), 2.0) << "an earlier run won";
  EXPECT_EQ(runs[1].SceneName(), "fox");
  EXPECT_TRUE(runs[1].SameWork(RunOf("data/fox/", "fast", 0.0, 0.0)));
  EXPECT_FALSE(runs[1].SameWork(RunOf("data/fox/", "paper", 0.0, 0.0)));
}

TEST(SuiteTable, HasRatiosMeansAndStages) {
  const std::string table = SuiteTable({RunOf("fern", "paper", 4.0, 100.0),
                                        RunOf("fern", "fast", 2.0, 50.0),
                                        RunOf("fox", "paper", 6.0, 100.0),
                                        RunOf("fox", "fast", 5.0, 80.0)},
                                       "paper");
  const auto row = [&](const std::string& begin) {
    const size_t at = table.find(begin);
    return at == std::string::npos ? "" : table.substr(at, table.find('\n', at) - at);
  };
  EXPECT_NE(row("| fern | fast |").find("| 2.00 |"), std::string::npos) << table;
  EXPECT_NE(row("| fern | fast |").find("| 0.50 | 0.50 | 25.0 |"), std::string::npos) << table;
  EXPECT_NE(row("| mean | fast |").find("| 3.50 |"), std::string::npos) << table;
  EXPECT_NE(row("| mean | fast |").find("| 0.70 | 0.65 |"), std::string::npos) << table;
  EXPECT_NE(table.find("| s personalize |"), std::string::npos) << table;
}

}  // namespace
}  // namespace color3d
