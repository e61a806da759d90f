// `color3d plan`: the plan before a run, against the jobs of the run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;

class PlanTest : public ServiceTest {
 protected:
  std::string Room() {
    ProceduralSceneOptions options = SmallRoom(4, /*gray=*/true);
    options.width = 160;
    options.height = 120;
    WriteProceduralScene(Path("room"), options);
    return Path("room").string();
  }
};

// "KIND runs" or "KIND is left out".
std::string Entry(const std::string& kind, bool runs) {
  return kind + (runs ? " runs" : " is left out");
}

TEST_F(PlanTest, TellsStagesAndCreatesNothing) {
  StartServer();
  const ProcessResult plan = Client({"plan", Room()});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, HasSubstr("reconstruct geometry"));
  EXPECT_THAT(plan.out, HasSubstr("left out"));
  EXPECT_THAT(plan.out, HasSubstr("expected: "));
  EXPECT_TRUE(server().ListJobs().empty());
}

TEST_F(PlanTest, RefusesTooShortBudget) {
  StartServer();
  ExpectRefusal(Client({"plan", Room(), "--time-budget", "5s"}), 2, {"give at least"});
}

TEST_F(PlanTest, RefusesBadFolder) {
  StartServer();
  EXPECT_NE(Client({"plan", Path("nothing").string()}).exit_code, 0);
}

TEST_F(PlanTest, EqualsJobsOfRun) {
  StartServer();
  const std::string room = Room();
  const std::vector<std::string> options =
      std::vector<std::string>{"--auto", "--key-view", "view002"} + QuickOptions();
  const ProcessResult before = Client(std::vector<std::string>{"--json", "plan", room} + options);
  ASSERT_EQ(before.exit_code, 0) << before.err;
  std::vector<std::string> planned, ran;
  const auto plan = nlohmann::json::parse(before.out);
  for (const auto& stage : plan.at("stages")) {
    planned.push_back(Entry(stage.at("kind"), stage.at("runs")));
  }
  const ProcessResult run =
      Client(std::vector<std::string>{"colorize", room, "-o", Path("out").string()} + options);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("expected: ")) << "the plan precedes the run";
  EXPECT_THAT(run.out, HasSubstr("of computing, took"));
  for (const v1::Job& job : server().ListJobs()) {
    if (job.kind() == "colorize_scene") continue;
    ran.push_back(Entry(job.kind(), job.state() != v1::Job::STATE_SKIPPED));
  }
  EXPECT_THAT(planned, ::testing::UnorderedElementsAreArray(ran));
}

}  // namespace
}  // namespace color3d
