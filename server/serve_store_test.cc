// Servers that share a PostgreSQL store and a folder of blobs; refusals of unusable stores.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/base/files.h"
#include "tests/support/service/postgresql_cluster.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/rpc_support.h"
#include "tests/support/service/scripted_trace.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ParseTrace;
using testing::PostgresqlCluster;
using testing::Range;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::SleepMs;
using testing::TestClient;

constexpr char kRequest[] = "3f0c9a52-7e4b-4c1d-9b1e-2f6d8a7c5b40";

class ServeStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresqlCluster::IsInstalled()) {
      GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing; install postgresql-15";
    }
    address_ = PostgresqlCluster::Shared().NewDatabase(/*with_tables=*/false);
    fs::create_directories(Blobs());
  }
  fs::path Blobs() const { return scratch_.path() / "blobs"; }
  std::unique_ptr<ServerProcess> Serve(const std::string& name) {
    const fs::path folder = scratch_.path() / name;
    std::error_code error;
    fs::create_directories(folder / "data");
    fs::create_directory_symlink(Blobs(), folder / "data" / "blobs", error);
    return std::make_unique<ServerProcess>(
        folder, std::vector<std::string>{"--store", address_, "--log-level", "info"});
  }
  // Returns the process id of the worker that runs this step of a job.
  static int WorkerAtStep(TestClient& client, const std::string& name, int64_t step) {
    for (int i = 0; i < 400; ++i) {
      const v1::Job job = client.Get(name);
      const size_t at = job.worker().rfind('@');  // worker-1-PID@HOST
      if (job.progress().step() >= step && at != std::string::npos) {
        return std::stoi(job.worker().substr(job.worker().rfind('-', at) + 1));
      }
      SleepMs(25);
    }
    ADD_FAILURE() << name << " made no progress";
    return 0;
  }
  static int ParentOf(int pid) {
    std::ifstream status("/proc/" + std::to_string(pid) + "/status");
    std::string word;
    while (status >> word) {
      if (word == "PPid:" && status >> pid) return pid;
    }
    return 0;
  }
  // Runs `color3d-server serve` to its end, which must come at once.
  ProcessResult ServeInVain(const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = {
        COLOR3D_SERVER, "serve", "--listen", "127.0.0.1:0", "--data-dir", scratch_.path() / "vain"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return RunProcess(arguments, scratch_.path(), std::chrono::seconds(60));
  }

  ScratchFolder scratch_;
  std::string address_;
};

TEST_F(ServeStoreTest, TwoServersShareJobsAndBlobs) {
  auto a = Serve("a"), b = Serve("b");
  const v1::JobSpec spec = ScriptedSpec(a->client().MakeScene().name(), "steps=8,ms=300");
  const v1::Job job = a->client().Create(spec, kRequest);
  EXPECT_EQ(b->client().Create(spec, kRequest).name(), job.name())
      << "a repeated call may reach another server";
  v1::WatchJobsRequest watch;
  watch.add_names(job.name());
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(120));
  auto events = b->client().jobs->WatchJobs(&context, watch);

  // The job runs at one of them, which is killed with its worker; the other one goes on.
  const int server = ParentOf(WorkerAtStep(b->client(), job.name(), 2));
  ASSERT_TRUE(server == a->pid() || server == b->pid()) << server;
  const bool runs_at_a = server == a->pid();
  std::unique_ptr<ServerProcess>& killed = runs_at_a ? a : b;
  ServerProcess& other = runs_at_a ? *b : *a;
  killed->Signal(SIGKILL);
  killed->Wait();
  const v1::Job done = other.client().WaitFinished(job.name());
  EXPECT_EQ(done.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(done.attempt(), 2);
  EXPECT_EQ(ParseTrace(other.client().Download(done.artifacts(0).digest())).steps, Range(8));
  if (runs_at_a) {
    v1::JobEvent event;
    std::vector<v1::Job::State> states;
    while (events->Read(&event)) {
      if (event.has_job()) states.push_back(event.job().state());
    }
    ASSERT_FALSE(states.empty());
    EXPECT_EQ(states.back(), v1::Job::STATE_SUCCEEDED) << "the watch ends with the job";
  } else {
    context.TryCancel();
  }
  v1::ReadJobLogRequest log;
  log.set_name(job.name());
  log.set_follow(true);
  grpc::ClientContext reading;
  const auto chunks = other.client().jobs->ReadJobLog(&reading, log);
  std::string lines;
  for (v1::JobLogChunk chunk; chunks->Read(&chunk);) lines += chunk.data();
  EXPECT_THAT(lines, HasSubstr("succeeded"));
  EXPECT_NE(lines.find("begins"), lines.rfind("begins")) << "one attempt at each server: " << lines;
  killed = Serve(runs_at_a ? "a" : "b");
  EXPECT_EQ(killed->client().Get(job.name()).state(), v1::Job::STATE_SUCCEEDED);
}

TEST_F(ServeStoreTest, PauseHoldsAllServers) {
  auto a = Serve("a"), b = Serve("b");
  grpc::ClientContext pausing;
  v1::PauseQueueResponse paused;
  EXPECT_TRUE(a->client().admin->PauseQueue(&pausing, {}, &paused).ok());
  const v1::JobSpec spec = ScriptedSpec(a->client().MakeScene().name(), "steps=1");
  const v1::Job job = b->client().Create(spec, kRequest);
  SleepMs(1500);
  for (const v1::Job& child : b->client().Children(job.name())) {
    EXPECT_LE(child.attempt(), 0) << child.kind() << " runs at the other server";
  }
  grpc::ClientContext resuming;
  v1::ResumeQueueResponse resumed;
  EXPECT_TRUE(b->client().admin->ResumeQueue(&resuming, {}, &resumed).ok());
  EXPECT_EQ(a->client().WaitFinished(job.name()).state(), v1::Job::STATE_SUCCEEDED);
}

TEST_F(ServeStoreTest, UnusableStoresGiveOneError) {
  const PostgresqlCluster& cluster = PostgresqlCluster::Shared();
  ProcessResult result =
      ServeInVain({"--workers", "0", "--store", "postgresql://me:secret@127.0.0.1:1/none"});
  EXPECT_EQ(result.exit_code, 1) << "a repetition may succeed";
  EXPECT_THAT(result.err, HasSubstr("cannot be reached"));
  EXPECT_EQ((result.out + result.err).find("secret"), std::string::npos) << result.err;
  result = ServeInVain({"--workers", "0", "--store", cluster.AddressOf("none")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("database \"none\" does not exist"));
  result = ServeInVain({"--workers", "0", "--store", "somewhere"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("write postgresql://"));
}

TEST_F(ServeStoreTest, SecondServerOnOneFileIsRefused) {
  const ServerProcess first(scratch_.path(), {}, /*workers=*/0);
  const ProcessResult second = RunProcess({COLOR3D_SERVER,
                                           "serve",
                                           "--listen",
                                           "127.0.0.1:0",
                                           "--workers",
                                           "0",
                                           "--data-dir",
                                           scratch_.path() / "data"},
                                          scratch_.path(),
                                          std::chrono::seconds(60));
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_THAT(second.err, HasSubstr("another server uses the data directory"));
}

}  // namespace
}  // namespace color3d
