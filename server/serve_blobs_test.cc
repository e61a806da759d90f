// Servers that keep their blobs in an object store: real processes, the scripted store of
// s3_server.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "core/base/digest.h"
#include "core/base/files.h"
#include "tests/support/service/postgresql_cluster.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/rpc_support.h"
#include "tests/support/service/s3_process.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::S3Process;
using testing::ServerProcess;
using testing::TestClient;

class ServeBlobsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!S3Process::IsInstalled()) GTEST_SKIP() << "NOT TESTED: python3 is missing";
    s3_ = std::make_unique<S3Process>(scratch_.path());
    key_ = s3_->KeyFile(scratch_.path());
  }
  std::vector<std::string> Flags() const {
    return {"--blobs",
            "s3://blobs/color3d",
            "--s3-endpoint",
            s3_->endpoint(),
            "--s3-credentials-file",
            key_};
  }
  std::unique_ptr<ServerProcess> Serve(const std::string& name = "one",
                                       const std::vector<std::string>& more = {}) {
    fs::create_directories(scratch_.path() / name);
    std::vector<std::string> flags = Flags();
    flags.insert(flags.end(), more.begin(), more.end());
    return std::make_unique<ServerProcess>(scratch_.path() / name, flags);
  }
  static v1::Job Color(TestClient& client) {
    v1::JobSpec spec;
    spec.set_scene(client.MakeScene().name());
    *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = client.Upload("key");
    return client.WaitFinished(client.Create(spec).name());
  }
  // Runs `color3d-server` to its end.
  ProcessResult Run(std::vector<std::string> arguments, const std::vector<std::string>& more) {
    arguments.insert(arguments.begin(), COLOR3D_SERVER);
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunProcess(arguments, scratch_.path() / "run", seconds(60));
  }
  ProcessResult ServeInVain(const std::vector<std::string>& flags,
                            const std::string& name = "vain") {
    return Run({"serve",
                "--listen",
                "127.0.0.1:0",
                "--data-dir",
                scratch_.path() / name,
                "--workers",
                "0"},
               flags);
  }
  int64_t CountBlobs() {
    int64_t count = 0;
    for (const std::string& key : s3_->Keys()) count += key.starts_with("color3d/blobs/") ? 1 : 0;
    return count;
  }

  ScratchFolder scratch_;
  std::unique_ptr<S3Process> s3_;
  fs::path key_;
};

TEST_F(ServeBlobsTest, ColorsAndReadsBackAfterRestart) {
  auto server = Serve();
  const v1::Job job = Color(server->client());
  ASSERT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.DebugString();
  ASSERT_GT(job.artifacts_size(), 0);
  std::vector<std::string> before;
  for (const v1::Artifact& artifact : job.artifacts()) {
    before.push_back(server->client().Download(artifact.digest()));
    EXPECT_NE(before.back(), "");
  }
  const fs::path data = scratch_.path() / "one" / "data";
  int in_folder = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data / "blobs")) {
    in_folder += IsSha256Hex(entry.path().filename().string()) ? 1 : 0;
  }
  EXPECT_EQ(in_folder, 0) << "nothing is in the folder";
  EXPECT_GT(CountBlobs(), 3);
  server->Signal(SIGTERM);
  EXPECT_EQ(server->Wait(), 0);
  fs::remove_all(data / "blob-cache");
  server = Serve();
  for (int i = 0; i < job.artifacts_size(); ++i) {
    EXPECT_EQ(server->client().Download(job.artifacts(i).digest()), before[i]);
  }
  // The same again comes from the stage cache, whose artifacts are touched in the store.
  EXPECT_EQ(Color(server->client()).state(), v1::Job::STATE_SUCCEEDED);
  server->Signal(SIGTERM);
  EXPECT_EQ(server->Wait(), 0);
  const ProcessResult fsck = Run({"fsck", "--data-dir", data}, Flags());
  EXPECT_EQ(fsck.exit_code, 0) << fsck.out << fsck.err;
  EXPECT_THAT(fsck.out, HasSubstr("0 missing, 0 damaged"));
}

TEST_F(ServeBlobsTest, JobsSurviveFailuresOfTheStore) {
  const auto server = Serve();
  s3_->Set(R"({"faults": [
      {"match": "PUT ", "count": 3, "kind": "status", "status": 503, "code": "SlowDown"},
      {"match": "PUT ", "count": 2, "kind": "lose"},
      {"match": "GET .*blobs/", "count": 3, "kind": "truncate"},
      {"match": "HEAD ", "count": 4, "kind": "drop"}]})");
  const v1::Job job = Color(server->client());
  ASSERT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.DebugString();
  for (const v1::Artifact& artifact : job.artifacts()) {
    EXPECT_NE(server->client().Download(artifact.digest()), "");
  }
}

// A drain does not wait for a store that does not answer.
TEST_F(ServeBlobsTest, EndsWhileTheStoreIsSilent) {
  const auto server = Serve("one", {"--drain-seconds", "2"});
  v1::Digest digest = server->client().Upload("some bytes");
  fs::remove_all(scratch_.path() / "one" / "data" / "blob-cache");
  fs::create_directories(scratch_.path() / "one" / "data" / "blob-cache");
  s3_->Set(R"({"faults": [{"match": "", "count": 1000, "kind": "late", "seconds": 100}]})");
  std::thread reader([&] {
    try {
      server->client().Download(digest);
    } catch (const std::exception&) {
    }
  });
  testing::SleepMs(500);
  const auto begin = std::chrono::steady_clock::now();
  server->Signal(SIGTERM);
  EXPECT_EQ(server->Wait(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(10));
  reader.join();
}

TEST_F(ServeBlobsTest, TwoServersShareTheBucket) {
  if (!testing::PostgresqlCluster::IsInstalled()) {
    GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing; install postgresql-15";
  }
  const std::string address =
      testing::PostgresqlCluster::Shared().NewDatabase(/*with_tables=*/false);
  const auto one = Serve("one", {"--store", address});
  const auto two = Serve("two", {"--store", address});
  const v1::Job job = Color(one->client());
  ASSERT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.DebugString();
  for (const v1::Artifact& artifact : job.artifacts()) {
    EXPECT_EQ(two->client().Download(artifact.digest()), one->client().Download(artifact.digest()));
  }
  const auto other = ServeInVain(Flags());
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("blobs of another store of jobs"));
}

TEST_F(ServeBlobsTest, RefusesWhatTheOperatorMustMend) {
  const auto expect = [&](const std::vector<std::string>& flags, int status, const char* remedy) {
    const ProcessResult result = ServeInVain(flags);
    EXPECT_EQ(result.exit_code, status) << result.err;
    EXPECT_THAT(result.err, HasSubstr(remedy));
    EXPECT_EQ(result.err.find("test/secret"), std::string::npos) << "tells the secret";
  };
  const auto with = [&](const std::string& flag, const std::string& value) {
    std::vector<std::string> flags = Flags();
    const auto at = std::find(flags.begin(), flags.end(), flag);
    if (at == flags.end()) {
      flags.insert(flags.end(), {flag, value});
    } else {
      *(at + 1) = value;
    }
    return flags;
  };
  expect({"--blobs", "s3://blobs"}, 2, "requires --s3-credentials-file");
  expect({"--s3-endpoint", s3_->endpoint()}, 2, "require --blobs");
  expect(with("--blobs", "folder"), 2, "give s3://BUCKET");
  expect(with("--blobs", "s3://missing"), 2, "create the bucket");
  expect(with("--s3-region", "eu-west-1"), 2, "give --s3-region us-east-1");
  expect(with("--s3-endpoint", "http://127.0.0.1:1"), 1, "check --s3-endpoint");
  expect(with("--s3-ca", "/no/such/file"), 2, "--s3-ca /no/such/file");
  expect(with("--s3-credentials-file", "/no/such/file"), 2, "/no/such/file");
  s3_->Set(R"({"skew_seconds": -4000})");
  expect(Flags(), 2, "set the clock of this machine");
  s3_->Set(R"({"skew_seconds": 0, "denied": "^DELETE"})");
  expect(Flags(), 2, "s3:DeleteObject");
  s3_->Set(R"({"denied": ""})");
  ASSERT_EQ(::chmod(key_.c_str(), 0644), 0);
  expect(Flags(), 2, "run chmod 600");
  WriteFileAtomic(key_, "access_key_id = TESTKEY\nsecret_access_key = wrong\n");
  ASSERT_EQ(::chmod(key_.c_str(), 0600), 0);
  expect(Flags(), 2, "does not belong to its access_key_id");
}

// A key that was replaced is used without a restart.
TEST_F(ServeBlobsTest, ReadsNewKeys) {
  const auto server = Serve();
  s3_->Set(R"({"id": "NEWKEY", "secret": "newer"})");
  WriteFileAtomic(key_, "access_key_id = NEWKEY\nsecret_access_key = newer\n");
  ::chmod(key_.c_str(), 0600);
  testing::SleepMs(1200);
  EXPECT_EQ(server->client().Download(server->client().Upload("bytes")), "bytes");
}

TEST_F(ServeBlobsTest, DataFolderRemembersWhereItsBlobsAre) {
  const fs::path data = scratch_.path() / "one" / "data";
  {
    const auto server = Serve();
    server->client().Upload("bytes");
    server->Signal(SIGTERM);
    EXPECT_EQ(server->Wait(), 0);
  }
  ProcessResult result = ServeInVain({}, "one/data");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("are in s3://blobs/color3d: give --blobs"));
  result = Run({"fsck", "--data-dir", data}, {});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("are in s3://blobs/color3d"));
  result = Run({"backup", scratch_.path() / "copy", "--data-dir", data}, {});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("are in s3://blobs/color3d and were not copied"));
  result = Run({"restore", scratch_.path() / "copy", "--data-dir", scratch_.path() / "again"}, {});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  result = ServeInVain({}, "again");
  EXPECT_THAT(result.err, HasSubstr("are in s3://blobs/color3d: give --blobs"));
  // And a folder that has blobs of its own.
  {
    fs::create_directories(scratch_.path() / "own");
    ServerProcess own(scratch_.path() / "own", {});
    own.client().Upload("bytes");
    own.Signal(SIGTERM);
    own.Wait();
  }
  result = ServeInVain(Flags(), "own/data");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("has blobs: copy them to s3://blobs/color3d/blobs"));
}

}  // namespace
}  // namespace color3d
