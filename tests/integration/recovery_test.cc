// Jobs resume from their last checkpoint after workers or servers are killed.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

using std::chrono::seconds;

// Geometry takes long enough to be interrupted after several checkpoints.
constexpr int kIterations = 1500;

class RecoveryTest : public ServiceTest {
 protected:
  void SetUp() override {
    StartServer(QuickRecovery());
    WriteProceduralScene(Path("room"), SmallRoom(8));
  }

  std::unique_ptr<Process> StartColorize() {
    return std::make_unique<Process>(ClientCommand({"colorize",
                                                    Path("room").string(),
                                                    "-o",
                                                    Path("out").string(),
                                                    "--benchmark",
                                                    "--max-side",
                                                    "240",
                                                    "--max-gaussians",
                                                    "15000",
                                                    "--geometry-iterations",
                                                    std::to_string(kIterations),
                                                    "--colorizer-iterations",
                                                    "4",
                                                    "--chroma-iterations",
                                                    "4"}),
                                     Path("client"));
  }

  v1::Job Geometry() {
    for (const v1::Job& job : server().ListJobs()) {
      if (job.kind() == "reconstruct_geometry") return job;
    }
    return {};
  }

  // Waits until training has continued after its first checkpoint, and returns the step.
  int64_t WaitForTheMiddle(Process& client) {
    v1::Job job;
    EXPECT_TRUE(WaitUntil(
        [&] {
          job = Geometry();
          return (job.state() == v1::Job::STATE_RUNNING && job.progress().step() > 300) ||
                 job.state() >= v1::Job::STATE_SUCCEEDED || !client.IsRunning();
        },
        seconds(200)))
        << client.Err();
    EXPECT_EQ(job.state(), v1::Job::STATE_RUNNING) << "training ended before it was interrupted";
    return job.progress().step();
  }

  // The first step that the next attempt reports.
  int64_t FirstStepOfAttempt(int attempt) {
    v1::Job job;
    EXPECT_TRUE(WaitUntil(
        [&] {
          job = Geometry();
          return job.attempt() >= attempt && job.state() == v1::Job::STATE_RUNNING &&
                 job.progress().step() > 0;
        },
        seconds(120),
        std::chrono::milliseconds(10)));
    return job.progress().step();
  }

  void ExpectFinished(Process& client) {
    const std::optional<int> code = client.Wait(seconds(400));
    ASSERT_EQ(code, 0) << client.Out() << client.Err();
    EXPECT_TRUE(std::filesystem::is_regular_file(Path("out") / "scene.ply"));
    const auto metrics = nlohmann::json::parse(ReadFile(Path("out") / "metrics.json"));
    EXPECT_GT(metrics.at("psnr_l").get<double>(), 17.0);
    ExpectNoStepTwice();
  }

  // Error curves continue over attempts: no iteration occurs twice.
  void ExpectNoStepTwice() {
    std::istringstream csv(ReadFile(Path("out") / "curves.csv"));
    std::set<std::string> seen;
    int rows = 0;
    std::string line;
    std::getline(csv, line);
    const std::vector<std::string> columns = Split(line);
    for (; std::getline(csv, line);) {
      const std::vector<std::string> cells = Split(line);
      ASSERT_EQ(cells.size(), columns.size()) << line;
      std::string key;
      for (size_t i = 0; i < cells.size(); ++i) {
        if (columns[i] != "seconds" && columns[i] != "value") key += cells[i] + ",";
      }
      if (key.find("reconstruct_geometry") == std::string::npos) continue;
      ++rows;
      EXPECT_TRUE(seen.insert(key).second) << key << " occurs twice";
    }
    EXPECT_GT(rows, 3);
  }

  static std::vector<std::string> Split(const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
  }
};

TEST_F(RecoveryTest, KilledWorkersJobResumesFromItsCheckpoint) {
  const std::unique_ptr<Process> client = StartColorize();
  const int64_t step = WaitForTheMiddle(*client);
  const std::string name = Geometry().name();
  pid_t worker = 0;
  const v1::ServerInfo server_info = server().Info();
  for (const v1::WorkerInfo& info : server_info.workers()) {
    if (info.job() == name) worker = static_cast<pid_t>(info.pid());
  }
  ASSERT_GT(worker, 1);
  const std::vector<pid_t> children = Descendants(server().pid());
  ASSERT_NE(std::find(children.begin(), children.end(), worker), children.end());
  ASSERT_EQ(kill(worker, SIGKILL), 0);

  const int64_t resumed = FirstStepOfAttempt(2);
  EXPECT_GT(resumed, step / 4) << "training started again, killed at " << step;
  ExpectFinished(*client);
  EXPECT_EQ(Geometry().attempt(), 2);
  EXPECT_EQ(Geometry().state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_FALSE(IsAlive(worker));
}

TEST_F(RecoveryTest, KilledServersJobResumesAfterRestart) {
  const std::unique_ptr<Process> client = StartColorize();
  const int64_t step = WaitForTheMiddle(*client);
  const std::string address = server().address();
  const std::vector<pid_t> workers = Descendants(server().pid());
  ASSERT_FALSE(workers.empty());
  ASSERT_EQ(kill(server().pid(), SIGKILL), 0);
  for (pid_t worker : workers) {
    EXPECT_TRUE(WaitUntil([&] { return !IsAlive(worker); }, seconds(30)))
        << "worker " << worker << " outlived its server";
    kill(worker, SIGKILL);
  }
  // The same address, so that the waiting client reconnects.
  StartServer(QuickRecovery(), address);
  EXPECT_GT(FirstStepOfAttempt(1), step / 4);
  ExpectFinished(*client);
}

TEST_F(RecoveryTest, DrainReleasesJobsWithoutCountingAnAttempt) {
  const std::unique_ptr<Process> client = StartColorize();
  const int64_t step = WaitForTheMiddle(*client);
  client->Signal(SIGKILL);
  EXPECT_EQ(server().Stop(), 0);
  EXPECT_EQ(server().Log().find("was killed by signal"), std::string::npos)
      << "a worker did not drain";
  StartServer(QuickRecovery());
  EXPECT_GT(FirstStepOfAttempt(1), step / 2);
  EXPECT_EQ(Geometry().attempt(), 1);
}

TEST_F(RecoveryTest, CancelledJobStopsAndCanBeRetried) {
  const std::unique_ptr<Process> client = StartColorize();
  WaitForTheMiddle(*client);
  const std::string root = NewestJob("colorize_scene").name();
  EXPECT_EQ(Client({"job", "cancel", root}).exit_code, 0);
  EXPECT_TRUE(
      WaitUntil([&] { return Geometry().state() == v1::Job::STATE_CANCELLED; }, seconds(20)));
  EXPECT_EQ(client->Wait(seconds(30)), 1) << client->Err();
  EXPECT_TRUE(server().IsHealthy());
  const ProcessResult retried = Client({"job", "retry", root});
  EXPECT_EQ(retried.exit_code, 0) << retried.err;
  const ProcessResult watched = Client({"job", "watch", root});
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
  EXPECT_EQ(Geometry().state(), v1::Job::STATE_SUCCEEDED);
}

}  // namespace
}  // namespace color3d
