// The real server process with worker processes that run scripted stages, under signals and kills.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <set>
#include <thread>

#include "core/base/digest.h"
#include "core/base/files.h"
#include "server/store/sql_database.h"
#include "tests/support/service/rpc_support.h"
#include "tests/support/service/scripted_trace.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::OpenTestDatabase;
using testing::ParseTrace;
using testing::Range;
using testing::RepeatedEffects;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::SleepMs;
using testing::TestClient;
using testing::Trace;

void WaitForStep(TestClient& client, const std::string& name, int64_t step) {
  for (int i = 0; i < 400; ++i) {
    if (client.Get(name).progress().step() >= step) return;
    SleepMs(25);
  }
  FAIL() << name << " made no progress";
}

class ProcessTest : public ::testing::Test {
 protected:
  ScratchFolder scratch_;
};

TEST_F(ProcessTest, RunsWholeGraphThenAnswersFromCache) {
  ServerProcess server(scratch_.path(), {}, 2);
  TestClient& client = server.client();
  v1::JobSpec spec;
  spec.set_scene(client.MakeScene().name());
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = client.Upload("key");
  const v1::Job first = client.WaitFinished(client.Create(spec).name());
  ASSERT_EQ(first.state(), v1::Job::STATE_SUCCEEDED) << first.DebugString();
  std::set<std::string> names;
  for (const v1::Artifact& artifact : first.artifacts()) names.insert(artifact.name());
  EXPECT_EQ(names, (std::set<std::string>{"report.html", "scene.ply"}));
  EXPECT_GT(first.peak_memory_bytes(), 0);
  EXPECT_THAT(client.Download(first.artifacts(0).digest()), HasSubstr("colorize_scene"));
  const v1::Job second = client.WaitFinished(client.Create(spec).name());
  EXPECT_EQ(second.state(), v1::Job::STATE_SUCCEEDED);
  for (const v1::Job& child : client.Children(second.name())) {
    if (child.state() == v1::Job::STATE_SKIPPED) continue;
    EXPECT_TRUE(child.cached()) << child.kind();
  }
  spec.set_skip_cache(true);
  const v1::Job third = client.WaitFinished(client.Create(spec).name());
  for (const v1::Job& child : client.Children(third.name())) EXPECT_FALSE(child.cached());
  const fs::path left_over = scratch_.path() / "data" / "scratch";
  for (int i = 0; i < 100 && !fs::is_empty(left_over); ++i) SleepMs(20);
  EXPECT_TRUE(fs::is_empty(left_over));
}

TEST_F(ProcessTest, ReportsFailuresWithReason) {
  ServerProcess server(scratch_.path(), {"--stuck-seconds", "1", "--stop-grace-seconds", "0.5"});
  TestClient& client = server.client();
  const std::string scene = client.MakeScene().name();
  const auto run = [&](const std::string& script) {
    return client.WaitFinished(client.Create(ScriptedSpec(scene, script)).name());
  };
  v1::Job job = run("throw");
  EXPECT_EQ(job.state(), v1::Job::STATE_FAILED);
  EXPECT_EQ(job.error().code(), static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT));
  EXPECT_THAT(job.error().message(), HasSubstr("scripted failure"));
  EXPECT_EQ(job.attempt(), 1);
  job = run("oom");
  EXPECT_EQ(job.error().code(), static_cast<int>(grpc::StatusCode::RESOURCE_EXHAUSTED));
  job = run("unavailable_once,steps=2");
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << "tried again";
  EXPECT_EQ(job.attempt(), 2);
  job = run("crash");
  EXPECT_EQ(job.state(), v1::Job::STATE_FAILED);
  EXPECT_EQ(job.attempt(), 3);
  EXPECT_THAT(job.error().message(), HasSubstr("worker died"));
  job = run("hang");
  EXPECT_EQ(job.state(), v1::Job::STATE_FAILED);
  EXPECT_EQ(job.error().code(), static_cast<int>(grpc::StatusCode::DEADLINE_EXCEEDED));
  EXPECT_EQ(run("steps=1").state(), v1::Job::STATE_SUCCEEDED) << "the service lives on";
}

// The name of a model does not identify its weights.
TEST_F(ProcessTest, NewWeightsUnderSameNameMissTheCache) {
  const fs::path weights = scratch_.path() / "weights";
  WriteFileAtomic(weights, "first");
  ServerProcess server(scratch_.path(), {"--model", "mine=" + weights.string()});
  TestClient& client = server.client();
  v1::JobSpec spec = ScriptedSpec(client.MakeScene().name(), "steps=1");
  spec.mutable_select_key_view()->set_encoder("mine");
  const auto is_cached = [&] {
    const v1::Job job = client.WaitFinished(client.Create(spec).name());
    EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.error().message();
    return job.cached();
  };
  EXPECT_FALSE(is_cached());
  EXPECT_TRUE(is_cached());
  WriteFileAtomic(weights, "other");
  EXPECT_FALSE(is_cached()) << "the result of the old weights was served";
  EXPECT_TRUE(is_cached());
  WriteFileAtomic(weights, "first");
  EXPECT_TRUE(is_cached()) << "equal bytes are equal work";
  fs::remove(weights);
  const v1::Job job = client.WaitFinished(client.Create(spec).name());
  EXPECT_EQ(job.state(), v1::Job::STATE_FAILED);
  EXPECT_THAT(job.error().message(), HasSubstr("restore it"));
}

TEST_F(ProcessTest, NoticesWeightsReplacedDuringJob) {
  const fs::path weights = scratch_.path() / "weights";
  WriteFileAtomic(weights, "first");
  ServerProcess server(scratch_.path(), {"--model", "mine=" + weights.string()});
  TestClient& client = server.client();
  v1::JobSpec spec = ScriptedSpec(client.MakeScene().name(), "steps=40,ms=50");
  spec.mutable_select_key_view()->set_encoder("mine");
  const std::string name = client.Create(spec).name();
  WaitForStep(client, name, 2);
  WriteFileAtomic(weights, "other");
  const v1::Job job = client.WaitFinished(name);
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.error().message();
  EXPECT_EQ(job.attempt(), 2) << "what was begun with the old weights was published";
}

TEST_F(ProcessTest, ListsModelsAndRefusesUnknownOnes) {
  const fs::path weights = scratch_.path() / "weights";
  WriteFileAtomic(weights, "........{\"visual.conv1.weight\":");
  ServerProcess server(scratch_.path(),
                       {"--model", "mine=" + weights.string(), "--backend", "gone=127.0.0.1:1"});
  TestClient& client = server.client();
  v1::ServerInfo info;
  grpc::ClientContext context;
  ASSERT_TRUE(client.server->GetServerInfo(&context, {}, &info).ok());
  ASSERT_EQ(info.models_size(), 1);
  EXPECT_EQ(info.models(0).name(), "mine");
  EXPECT_EQ(info.models(0).kind(), "clip");
  EXPECT_EQ(info.models(0).sha256(), DigestFile(weights).sha256);
  ASSERT_EQ(info.backends_size(), 1);
  EXPECT_FALSE(info.backends(0).reachable());
  EXPECT_NE(info.backends(0).problem(), "");
  v1::JobSpec spec = ScriptedSpec(client.MakeScene().name(), "steps=1");
  spec.mutable_select_key_view()->set_encoder("yours");
  try {
    client.Create(spec);
    FAIL() << "a model that there is not was accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("it has: mine"));
  }
}

TEST_F(ProcessTest, CancelsRunningJobSoon) {
  ServerProcess server(scratch_.path(), {});
  TestClient& client = server.client();
  const std::string name =
      client.Create(ScriptedSpec(client.MakeScene().name(), "steps=1000,ms=50")).name();
  WaitForStep(client, name, 2);
  v1::CancelJobRequest request;
  request.set_name(name);
  grpc::ClientContext context;
  v1::Job job;
  ASSERT_TRUE(client.jobs->CancelJob(&context, request, &job).ok());
  EXPECT_TRUE(job.cancel_requested());
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(client.WaitFinished(name).state(), v1::Job::STATE_CANCELLED);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(3));
}

TEST_F(ProcessTest, TerminatedServerReleasesJobToNextOne) {
  std::string name;
  int64_t steps_before = 0;
  {
    ServerProcess server(scratch_.path(), {});
    TestClient& client = server.client();
    name = client.Create(ScriptedSpec(client.MakeScene().name(), "steps=40,ms=50")).name();
    WaitForStep(client, name, 5);
    steps_before = client.Get(name).progress().step();
    const auto start = std::chrono::steady_clock::now();
    server.Signal(SIGTERM);
    EXPECT_EQ(server.Wait(), 0);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  }
  {
    const auto db = OpenTestDatabase(scratch_.path() / "data");
    SqlStatement job(*db, "select state, attempt from job where name=?", name);
    ASSERT_TRUE(job.Step());
    EXPECT_EQ(job.Text(0), "QUEUED");
    EXPECT_EQ(job.Int(1), 0) << "a drain does not count";
  }
  ServerProcess server(scratch_.path(), {});
  const v1::Job job = server.client().WaitFinished(name);
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(job.attempt(), 1);
  const Trace trace = ParseTrace(server.client().Download(job.artifacts(0).digest()));
  EXPECT_EQ(trace.steps, Range(40));
  EXPECT_EQ(trace.processes.size(), 2u) << "it went on from step " << steps_before;
}

TEST_F(ProcessTest, SecondSignalEndsAtOnce) {
  ServerProcess server(scratch_.path(), {"--stop-grace-seconds", "1"});
  TestClient& client = server.client();
  const std::string name = client.Create(ScriptedSpec(client.MakeScene().name(), "hang")).name();
  for (int i = 0; i < 200 && client.Get(name).state() != v1::Job::STATE_RUNNING; ++i) SleepMs(25);
  server.Signal(SIGTERM);
  SleepMs(300);
  const auto start = std::chrono::steady_clock::now();
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 1);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

TEST_F(ProcessTest, WorkersEndWithKilledServerAndNothingIsLost) {
  std::string name;
  std::vector<pid_t> workers;
  {
    ServerProcess server(scratch_.path(), {});
    TestClient& client = server.client();
    name = client.Create(ScriptedSpec(client.MakeScene().name(), "steps=40,ms=50")).name();
    WaitForStep(client, name, 3);
    workers = server.Workers();
    server.Signal(SIGKILL);
    server.Wait();
  }
  ASSERT_FALSE(workers.empty());
  for (const pid_t worker : workers) {
    for (int i = 0; i < 800 && ::kill(worker, 0) == 0; ++i) SleepMs(25);
    EXPECT_NE(::kill(worker, 0), 0) << "an orphan stays";
  }
  ServerProcess server(scratch_.path(), {});
  const v1::Job job = server.client().WaitFinished(name);
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(ParseTrace(server.client().Download(job.artifacts(0).digest())).steps, Range(40));
}

TEST_F(ProcessTest, IdleServerIsSmall) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "most of the memory is ThreadSanitizer's";
#endif
  ServerProcess server(scratch_.path(), {});
  server.client().MakeScene();
  v1::ServerInfo info;
  grpc::ClientContext context;
  ASSERT_TRUE(server.client().server->GetServerInfo(&context, {}, &info).ok());
  EXPECT_LT(info.memory_bytes(), int64_t{60} << 20);
  EXPECT_GT(info.memory_bytes(), int64_t{1} << 20);
}

// Hardest case of the fence: the owner sleeps past its lease, and resumes in the middle of a step
// while another worker has taken the job over.
TEST_F(ProcessTest, ThawedZombieChangesNothing) {
  const fs::path effects = scratch_.path() / "effects";
  ::setenv("COLOR3D_TEST_EFFECTS", effects.c_str(), 1);
  ServerProcess server(scratch_.path(), {}, 2);
  ::unsetenv("COLOR3D_TEST_EFFECTS");
  TestClient& client = server.client();
  const std::string name =
      client.Create(ScriptedSpec(client.MakeScene().name(), "steps=60,ms=80")).name();
  WaitForStep(client, name, 3);
  v1::ServerInfo info;
  grpc::ClientContext context;
  ASSERT_TRUE(client.server->GetServerInfo(&context, {}, &info).ok());
  pid_t owner = 0;
  for (const v1::WorkerInfo& worker : info.workers()) {
    if (worker.job() == name) owner = static_cast<pid_t>(worker.pid());
  }
  ASSERT_NE(owner, 0);
  ::kill(owner, SIGSTOP);
  const int64_t stopped_at = client.Get(name).progress().step();
  for (int i = 0; i < 200 && client.Get(name).attempt() < 2; ++i) SleepMs(25);
  WaitForStep(client, name, stopped_at + 5);
  ::kill(owner, SIGCONT);
  const v1::Job job = client.WaitFinished(name);
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(job.attempt(), 2);
  EXPECT_EQ(ParseTrace(client.Download(job.artifacts(0).digest())).steps, Range(60));
  EXPECT_EQ(RepeatedEffects(effects.string() + ".saved"), 0);
  EXPECT_GT(RepeatedEffects(effects.string() + ".begun"), 0)
      << "negative control: what is not fenced does repeat";
}

TEST_F(ProcessTest, FrozenWorkerIsKilled) {
  ServerProcess server(scratch_.path(), {}, 1);
  TestClient& client = server.client();
  const std::string name =
      client.Create(ScriptedSpec(client.MakeScene().name(), "steps=60,ms=80")).name();
  WaitForStep(client, name, 2);
  ::kill(server.Workers().at(0), SIGSTOP);
  EXPECT_EQ(client.WaitFinished(name).state(), v1::Job::STATE_SUCCEEDED);
}

// The service manager, the server and the kernel may each terminate a worker.
TEST_F(ProcessTest, WorkersDrainOnRepeatedSignals) {
  ServerProcess server(scratch_.path(), {});
  TestClient& client = server.client();
  const std::string name =
      client.Create(ScriptedSpec(client.MakeScene().name(), "steps=20,ms=100")).name();
  WaitForStep(client, name, 3);
  const pid_t worker = server.Workers().at(0);
  for (int i = 0; i < 5; ++i) {
    ::kill(worker, SIGTERM);
    SleepMs(5);
  }
  const v1::Job job = client.WaitFinished(name);
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(job.attempt(), 1) << "a drain does not count";
  EXPECT_EQ(ParseTrace(client.Download(job.artifacts(0).digest())).processes.size(), 2u);
}

}  // namespace
}  // namespace color3d
