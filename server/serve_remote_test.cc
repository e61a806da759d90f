// Workers on another machine: real processes that know the address of the server and a token, with
// a folder of their own, over TLS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "core/base/files.h"
#include "server/access/tokens.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/scripted_trace.h"
#include "tests/support/service/server_process.h"
#include "tests/support/service/test_certificates.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::ParseTrace;
using testing::Range;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::TestClient;

class RemoteWorkerTest : public ::testing::Test {
 protected:
  RemoteWorkerTest() {
    certificate_ = authority_.Issue("server");
    tokens_ = scratch_.path() / "tokens";
    operator_ = AddToken(tokens_, "operator", Role::kAdmin);
    WriteFileAtomic(scratch_.path() / "token", AddToken(tokens_, "gpu", Role::kWorker) + "\n");
  }

  // Without workers of its own.
  void StartServer(std::vector<std::string> flags = {}, const std::string& lease_s = "3") {
    flags.insert(flags.end(),
                 {"--lease-seconds",
                  lease_s,
                  "--tls-cert",
                  certificate_.certificate,
                  "--tls-key",
                  certificate_.key,
                  "--tokens",
                  tokens_,
                  "--listen",
                  address_});
    server_ = std::make_unique<ServerProcess>(scratch_.path(), flags, /*workers=*/0);
    address_ = server_->address();
    grpc::SslCredentialsOptions tls;
    tls.pem_root_certs = ReadFile(authority_.certificate());
    client_ = std::make_unique<TestClient>(grpc::CreateChannel(
        address_,
        grpc::CompositeChannelCredentials(grpc::SslCredentials(tls),
                                          grpc::AccessTokenCredentials(operator_))));
  }

  std::unique_ptr<Process> StartWorker(std::vector<std::string> flags = {},
                                       const std::string& folder = "worker",
                                       const std::string& token_file = "token") {
    std::vector<std::string> arguments = {COLOR3D_TEST_WORKER,
                                          "--server",
                                          "https://" + address_,
                                          "--tls-ca",
                                          authority_.certificate(),
                                          "--token-file",
                                          scratch_.path() / token_file,
                                          "--cache-dir",
                                          scratch_.path() / folder,
                                          "--name",
                                          folder};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return std::make_unique<Process>(arguments, scratch_.path() / "logs");
  }

  std::string Submit(const std::string& script) {
    if (scene_.empty()) scene_ = client_->MakeScene().name();
    return client_->Create(ScriptedSpec(scene_, script, ++seed_)).name();
  }
  bool WaitForStep(const std::string& job, int64_t step) {
    return WaitUntil([&] { return client_->Get(job).progress().step() >= step; }, seconds(20));
  }
  std::string JobLog(const std::string& job) {
    v1::ReadJobLogRequest request;
    request.set_name(job);
    grpc::ClientContext context;
    const auto stream = client_->jobs->ReadJobLog(&context, request);
    std::string text;
    for (v1::JobLogChunk chunk; stream->Read(&chunk);) text += chunk.data();
    return text;
  }
  testing::Trace TraceOf(const v1::Job& job) {
    return ParseTrace(client_->Download(job.artifacts(0).digest()));
  }

  ScratchFolder scratch_;
  testing::TestAuthority authority_{scratch_.path(), "ours"};
  testing::CertificateFiles certificate_;
  fs::path tokens_;
  std::string operator_, address_ = "127.0.0.1:0", scene_;
  int seed_ = 0;
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<TestClient> client_;
};

TEST_F(RemoteWorkerTest, RunsJobsFromItsOwnFolder) {
  StartServer();
  const auto worker = StartWorker();
  v1::JobSpec spec;
  spec.set_scene(client_->MakeScene().name());
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = client_->Upload("key");
  const v1::Job job = client_->WaitFinished(client_->Create(spec).name());
  ASSERT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.DebugString() << worker->Err();
  for (const v1::Artifact& artifact : job.artifacts()) {
    EXPECT_NE(client_->Download(artifact.digest()), "");
  }
  EXPECT_THAT(job.worker(), ::testing::EndsWith("@gpu"));
  EXPECT_TRUE(WaitUntil([&] { return JobLog(job.name()).find("succeeded") != std::string::npos; },
                        seconds(10)))
      << JobLog(job.name());
  EXPECT_FALSE(fs::is_empty(scratch_.path() / "worker" / "blobs")) << "nothing is cached";
  const fs::path left_over = scratch_.path() / "worker" / "scratch";
  EXPECT_TRUE(WaitUntil([&] { return fs::is_empty(left_over); }, seconds(5)));
  const v1::ServerInfo info = [&] {
    v1::ServerInfo answer;
    grpc::ClientContext context;
    client_->server->GetServerInfo(&context, {}, &answer);
    return answer;
  }();
  ASSERT_EQ(info.workers_size(), 1);
  EXPECT_EQ(info.workers(0).pid(), 0) << "of another machine";
  worker->Signal(SIGTERM);
  EXPECT_EQ(worker->Wait(seconds(10)), 0) << worker->Err();
}

TEST_F(RemoteWorkerTest, ReleasesJobOnSignalsAndNearTheEndOfItsTime) {
  StartServer();
  const std::string job = Submit("steps=150,ms=50");
  int64_t seen = 0;
  for (const int signal : {SIGTERM, SIGUSR1, 0}) {
    // Four seconds of work, and the time that a worker reserves for its end.
    const auto worker = StartWorker(
        signal == 0 ? std::vector<std::string>{"--until", "19", "--drain-grace-seconds", "0.2"}
                    : std::vector<std::string>{});
    ASSERT_TRUE(WaitForStep(job, seen + 3)) << worker->Err();
    if (signal != 0) worker->Signal(signal);
    EXPECT_EQ(worker->Wait(seconds(15)), 0) << worker->Err();
    const v1::Job waiting = client_->Get(job);
    EXPECT_EQ(waiting.state(), v1::Job::STATE_QUEUED) << "signal " << signal;
    EXPECT_EQ(waiting.attempt(), 0) << "a drain does not count";
    seen = waiting.progress().step();
  }
  const auto worker = StartWorker();
  const v1::Job done = client_->WaitFinished(job);
  EXPECT_EQ(done.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(done.attempt(), 1);
  EXPECT_EQ(TraceOf(done).steps, Range(150));
  EXPECT_EQ(TraceOf(done).processes.size(), 4u);
}

TEST_F(RemoteWorkerTest, EndsWithoutWork) {
  StartServer();
  const auto worker = StartWorker({"--idle-exit", "1s"});
  EXPECT_EQ(worker->Wait(seconds(15)), 0) << worker->Err();
  EXPECT_THAT(worker->Err(), HasSubstr("there was no job for 1 s"));
}

// An absence that is shorter than the lease.
TEST_F(RemoteWorkerTest, JobOutlivesRestartOfServer) {
  StartServer({}, "20");
  const auto worker = StartWorker();
  const std::string job = Submit("steps=80,ms=50");
  ASSERT_TRUE(WaitForStep(job, 5)) << worker->Err();
  for (const int signal : {SIGTERM, SIGKILL}) {
    server_->Signal(signal);
    server_->Wait();
    StartServer({}, "20");
  }
  const v1::Job done = client_->WaitFinished(job);
  EXPECT_EQ(done.state(), v1::Job::STATE_SUCCEEDED) << worker->Err();
  EXPECT_EQ(done.attempt(), 1);
  EXPECT_EQ(TraceOf(done).steps, Range(80));
  EXPECT_EQ(TraceOf(done).processes.size(), 1u);
}

TEST_F(RemoteWorkerTest, AnotherWorkerContinuesAfterLostOne) {
  StartServer();
  auto lost = StartWorker();
  const std::string job = Submit("steps=60,ms=50");
  ASSERT_TRUE(WaitForStep(job, 5)) << lost->Err();
  lost->Signal(SIGSTOP);
  const auto next = StartWorker({}, "next");
  ASSERT_TRUE(WaitUntil([&] { return client_->Get(job).attempt() == 2; }, seconds(20)))
      << next->Err();
  lost->Signal(SIGCONT);
  const v1::Job done = client_->WaitFinished(job);
  EXPECT_EQ(done.state(), v1::Job::STATE_SUCCEEDED) << next->Err();
  EXPECT_EQ(done.attempt(), 2);
  EXPECT_EQ(TraceOf(done).steps, Range(60));
}

TEST_F(RemoteWorkerTest, EndsWhenTheServerRefusesIt) {
  StartServer();
  WriteFileAtomic(scratch_.path() / "low-token", AddToken(tokens_, "anna", Role::kSubmit));
  WriteFileAtomic(scratch_.path() / "unknown-token", "c3d_0000");
  testing::SleepMs(1100);  // the server reads its tokens at most once a second
  const auto low = StartWorker({}, "low", "low-token");
  EXPECT_EQ(low->Wait(seconds(15)), 2);
  EXPECT_THAT(low->Err(), HasSubstr("this call needs worker"));
  const auto unknown = StartWorker({}, "unknown", "unknown-token");
  EXPECT_EQ(unknown->Wait(seconds(15)), 2);
  EXPECT_THAT(unknown->Err(), HasSubstr("does not know the token"));
  const auto first = StartWorker();
  ASSERT_TRUE(
      WaitUntil([&] { return fs::exists(scratch_.path() / "worker" / "lock"); }, seconds(10)));
  const auto second = StartWorker();
  EXPECT_EQ(second->Wait(seconds(15)), 2);
  EXPECT_THAT(second->Err(), HasSubstr("another worker uses it; choose another --cache-dir"));
}

// A command in place of an engine: it starts one worker if it is told of any.
TEST_F(RemoteWorkerTest, AreStartedByTheScaleCommand) {
  const fs::path program = scratch_.path() / "scale", told = scratch_.path() / "told",
                 log = scratch_.path() / "engine.log";
  WriteFileAtomic(program,
                  "#!/bin/sh\ncd '" + scratch_.path().string() + "'\necho $1 >> told\n" +
                      "[ $1 -gt 0 ] && mkdir engine || exit 0\nsetsid " + COLOR3D_TEST_WORKER +
                      " --server https://$(cat port) --tls-ca " +
                      authority_.certificate().string() +
                      " --token-file token --cache-dir engine --name engine --idle-exit 1s"
                      " > engine.log 2>&1 &\n");
  fs::permissions(program, fs::perms::owner_all);
  const auto lines = [&] { return fs::exists(told) ? ReadFile(told) : ""; };
  StartServer({"--scale-command", program, "--scale-max", "2", "--scale-seconds", "1"});
  ASSERT_TRUE(WaitUntil([&] { return lines() == "0\n"; }, seconds(10))) << lines();
  std::vector<std::string> jobs;
  for (int i = 0; i < 5; ++i) jobs.push_back(Submit("steps=30,ms=50"));
  for (const std::string& job : jobs) {
    const v1::Job done = client_->WaitFinished(job);
    EXPECT_EQ(done.state(), v1::Job::STATE_SUCCEEDED) << done.DebugString();
    EXPECT_EQ(done.attempt(), 1);
  }
  EXPECT_TRUE(WaitUntil([&] { return lines().ends_with("\n0\n"); }, seconds(20))) << lines();
  EXPECT_THAT(lines(), ::testing::MatchesRegex("0\n(1\n)?2\n(1\n)?0\n"));
  EXPECT_TRUE(
      WaitUntil([&] { return ReadFile(log).find("there was no job for 1 s") != std::string::npos; },
                seconds(20)))
      << ReadFile(log);
}

TEST_F(RemoteWorkerTest, HangingScaleCommandDelaysNothingAndEndsWithTheServer) {
  const fs::path program = scratch_.path() / "scale", child = scratch_.path() / "child";
  WriteFileAtomic(
      program,
      "#!/bin/sh\ntrap '' TERM\nsleep 1000 &\necho $! > '" + child.string() + "'\nwait\nwait\n");
  fs::permissions(program, fs::perms::owner_all);
  StartServer({"--scale-command", program});
  ASSERT_TRUE(
      WaitUntil([&] { return fs::exists(child) && !ReadFile(child).empty(); }, seconds(10)));
  const pid_t pid = std::stoi(ReadFile(child));
  EXPECT_TRUE(IsAlive(pid));
  const auto worker = StartWorker();
  EXPECT_EQ(client_->WaitFinished(Submit("steps=3")).state(), v1::Job::STATE_SUCCEEDED);
  const auto start = std::chrono::steady_clock::now();
  server_->Signal(SIGTERM);
  EXPECT_EQ(server_->Wait(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - start, seconds(10));
  EXPECT_TRUE(WaitUntil([&] { return !IsAlive(pid); }, seconds(5)));
}

TEST_F(RemoteWorkerTest, RefusesOtherWeightsOfTheSameName) {
  WriteFileAtomic(scratch_.path() / "weights", "of the server");
  fs::create_directories(scratch_.path() / "elsewhere");
  WriteFileAtomic(scratch_.path() / "elsewhere" / "weights", "of the worker");
  StartServer({"--model", "mine=" + (scratch_.path() / "weights").string()});
  const std::string own = "mine=" + (scratch_.path() / "elsewhere" / "weights").string();
  const auto other = StartWorker({"--model", own}, "other");
  EXPECT_EQ(other->Wait(seconds(15)), 2);
  EXPECT_THAT(other->Err(), HasSubstr("differ from the server's"));
  WriteFileAtomic(scratch_.path() / "elsewhere" / "weights", "of the server");
  const auto same = StartWorker({"--model", own});
  v1::JobSpec spec = ScriptedSpec(client_->MakeScene().name(), "steps=1");
  spec.mutable_select_key_view()->set_encoder("mine");
  EXPECT_EQ(client_->WaitFinished(client_->Create(spec).name()).state(), v1::Job::STATE_SUCCEEDED)
      << same->Err();
}

}  // namespace
}  // namespace color3d
