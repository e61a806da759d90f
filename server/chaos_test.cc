// Hundreds of jobs on one data folder while workers and servers are killed, frozen and told to end.
// COLOR3D_CHAOS_JOBS, _FAULTS and _SEED say how many and how; label "chaos".
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <map>
#include <memory>

#include "core/base/digest.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "server/store/sqlite_db.h"
#include "tests/support/service/rpc_support.h"
#include "tests/support/service/scripted_trace.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::ParseTrace;
using testing::Range;
using testing::RepeatedEffects;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::SleepMs;
using testing::TestClient;
using testing::Trace;

constexpr int kSteps = 8;
constexpr int kStepMs = 150;  // every job outlives its lease of one second
constexpr int kWorkers = 3;
constexpr int kSubmittedFirst = 20;

int64_t FromEnvironment(const char* name, int64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::atoll(text) : otherwise;
}

class ChaosTest : public ::testing::Test {
 protected:
  ChaosTest() {
    ::setenv("COLOR3D_TEST_EFFECTS", effects_.c_str(), 1);
    StartServer();
  }
  ~ChaosTest() override { ::unsetenv("COLOR3D_TEST_EFFECTS"); }

  void StartServer() {
    server_ = std::make_unique<ServerProcess>(
        scratch_.path(),
        std::vector<std::string>{"--max-attempts", "1000", "--log-level", "off"},
        kWorkers);
  }

  void Submit() {
    TestClient& client = server_->client();
    if (scene_.empty()) scene_ = client.MakeScene().name();
    const std::string script = "steps=" + std::to_string(kSteps) + ",ms=" + std::to_string(kStepMs);
    const int seed = static_cast<int>(names_.size()) + 1;  // no two jobs are equal work
    names_.push_back(client.Create(ScriptedSpec(scene_, script, seed)).name());
  }

  // What happens to a service in its life.
  void Disturb() {
    const std::vector<pid_t> workers = server_->Workers();
    const int kind = static_cast<int>(random_->NextBelow(20));
    if (kind >= 18) {  // the server is killed, or told to end
      server_->Signal(kind == 18 ? SIGKILL : SIGTERM);
      server_->Wait();
      StartServer();
      ++faults_[kind == 18 ? "server killed" : "server restarted"];
      return;
    }
    if (workers.empty()) return;
    const pid_t victim = workers[random_->NextBelow(static_cast<uint32_t>(workers.size()))];
    if (kind < 7) {
      ::kill(victim, SIGKILL);
      ++faults_["worker killed"];
    } else if (kind < 14) {
      ::kill(victim, SIGSTOP);
      SleepMs(1300);
      ::kill(victim, SIGCONT);
      ++faults_["worker frozen past its lease"];
    } else {
      const int times = kind < 16 ? 1 : 5;
      for (int i = 0; i < times; ++i) ::kill(victim, SIGTERM);
      ++faults_["worker told to end"];
    }
  }

  void CheckResult(const std::string& name) {
    const v1::Job job = server_->client().WaitFinished(name, 300);
    ASSERT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.DebugString();
    ASSERT_EQ(job.artifacts_size(), 1);
    const Trace trace = ParseTrace(server_->client().Download(job.artifacts(0).digest()));
    EXPECT_EQ(trace.steps, Range(kSteps)) << name;
    taken_over_ += trace.processes.size() > 1 ? 1 : 0;
  }

  int64_t Count(const char* sql) {
    SqliteDatabase db(scratch_.path() / "data" / "jobs.db", SqliteAccess::kRead);
    SqliteStatement select(db.handle(), sql);
    return select.Step() ? select.Int(0) : -1;
  }

  ScratchFolder scratch_;
  const fs::path effects_ = scratch_.path() / "effects";
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<Random> random_;
  std::string scene_;
  std::vector<std::string> names_;
  std::map<std::string, int> faults_;
  int taken_over_ = 0;
};

TEST_F(ChaosTest, EveryJobEndsAndEveryEffectIsThereOnce) {
  const int64_t jobs = FromEnvironment("COLOR3D_CHAOS_JOBS", 200);
  const int64_t faults = FromEnvironment("COLOR3D_CHAOS_FAULTS", 60);
  const int64_t seed = FromEnvironment("COLOR3D_CHAOS_SEED", ::time(nullptr));
  std::cout << "seed " << seed << "\n";
  random_ = std::make_unique<Random>(static_cast<uint64_t>(seed));
  for (int i = 0; i < kSubmittedFirst && i < jobs; ++i) Submit();
  int64_t disturbed = 0;
  while (disturbed < faults) {
    SleepMs(100 + static_cast<int>(random_->NextBelow(600)));
    Disturb();
    disturbed = 0;
    for (const auto& [kind, count] : faults_) disturbed += count;
    // So that there is work to disturb until the end.
    const int64_t due = kSubmittedFirst + (jobs - kSubmittedFirst) * disturbed / faults;
    while (static_cast<int64_t>(names_.size()) < std::min(due, jobs)) Submit();
  }
  for (const std::string& name : names_) CheckResult(name);
  EXPECT_EQ(static_cast<int64_t>(names_.size()), jobs);
  EXPECT_GT(taken_over_, 0) << "no job was ever taken over: the test proves nothing";
  EXPECT_EQ(RepeatedEffects(effects_.string() + ".saved"), 0) << "an effect is there twice";
  EXPECT_GT(RepeatedEffects(effects_.string() + ".begun"), 0)
      << "negative control: what is not fenced does repeat";
  server_->Signal(SIGTERM);
  EXPECT_EQ(server_->Wait(), 0);
  EXPECT_EQ(Count("select count(*) from job where state='RUNNING'"), 0);
  EXPECT_EQ(Count("select count(*) from job_attempt where end_ms=0"), 0);
  EXPECT_EQ(Count("select count(*) - count(distinct job_id) from job_attempt where "
                  "outcome='SUCCEEDED'"),
            0)
      << "a job succeeded twice";
  for (const auto& [kind, count] : faults_) std::cout << count << " x " << kind << "\n";
  std::cout << names_.size() << " submissions, " << taken_over_
            << " taken over by another process, "
            << Count("select count(*) from job_attempt where outcome='LOST'")
            << " attempts lost, losses 0\n";
}

}  // namespace
}  // namespace color3d
