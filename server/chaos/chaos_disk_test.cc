// The disk of the data folder fills up while jobs run, and gets space again. The folder is a small
// file system of its own, which requires root or user namespaces. COLOR3D_CHAOS_JOBS: number of
// jobs (8). Label "chaos".
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

#include "core/base/files.h"
#include "server/store/sqlite_db.h"
#include "tests/support/service/chaos_service.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::ChaosService;
using ::testing::IsEmpty;
using testing::ResultOf;
using testing::ScriptedSpec;
using testing::SleepMs;
using testing::TestClient;

constexpr char kScript[] = "steps=30,ms=100";
constexpr char kDiskSize[] = "size=32m";
constexpr char kLargeDiskSize[] = "size=300m";
constexpr int64_t kUploadBytes = 2'000'000;

bool Says(const char* file, const std::string& text) {
  return static_cast<bool>(std::ofstream(file) << text << std::flush);
}

// Makes later mounts visible to this thread and its children only. Returns the reason of a failure,
// or an empty string.
std::string UnshareMounts() {
  const uid_t user = ::geteuid();
  const gid_t group = ::getegid();
  if (::unshare(user == 0 ? CLONE_NEWNS : CLONE_NEWNS | CLONE_NEWUSER) != 0) {
    return std::string("unshare: ") + std::strerror(errno);
  }
  if (user != 0 && (!Says("/proc/self/setgroups", "deny") ||
                    !Says("/proc/self/uid_map", "0 " + std::to_string(user) + " 1") ||
                    !Says("/proc/self/gid_map", "0 " + std::to_string(group) + " 1"))) {
    return "this user cannot be root in a namespace of his own";
  }
  if (::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) {
    return std::string("mount: ") + std::strerror(errno);
  }
  return "";
}

class ChaosDiskTest : public ::testing::Test {
 protected:
  explicit ChaosDiskTest(const char* size = kDiskSize) : size_(size) {}
  void SetUp() override {
    std::string why = UnshareMounts();
    fs::create_directory(disk_);
    if (why.empty() && ::mount("none", disk_.c_str(), "tmpfs", 0, size_) != 0) {
      why = std::string("mount: ") + std::strerror(errno);
    }
    if (!why.empty()) GTEST_SKIP() << "A FULL DISK WAS NOT TESTED: " << why;
    is_mounted_ = true;
  }
  void TearDown() override {
    if (is_mounted_) ::umount2(disk_.c_str(), MNT_DETACH);
  }

  // Fills the disk except for `free_bytes`.
  void Fill(int64_t free_bytes) const {
    const std::string page(4096, 'x');
    std::ofstream file(filler_, std::ios::binary | std::ios::app);
    while (static_cast<int64_t>(fs::space(disk_).available) >= free_bytes) {
      if (!file.write(page.data(), static_cast<std::streamsize>(page.size())).flush()) return;
    }
  }

  // Runs jobs while `free_bytes` are left for some seconds.
  struct Outcome {
    int failed = 0, refused = 0, lost_attempts = 0;
  };
  Outcome Endure(const std::string& reserve_mib,
                 const std::string& low_space_mib,
                 int64_t free_bytes);

  const char* const size_;
  ScratchFolder scratch_;
  const fs::path disk_ = scratch_.path() / "data";
  const fs::path filler_ = disk_ / "filler";
  const int jobs_ = static_cast<int>(testing::FromEnvironment("COLOR3D_CHAOS_JOBS", 8));
  bool is_mounted_ = false;
};

std::string ReasonOfJob(const v1::Job& job) {
  google::rpc::ErrorInfo info;
  for (const auto& detail : job.error().details()) {
    if (detail.UnpackTo(&info)) return info.reason();
  }
  return "";
}

void ExpectAnAnswer(TestClient& client, const std::string& job) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(1));
  v1::GetJobRequest request;
  request.set_name(job);
  v1::Job answer;
  const grpc::Status status = client.jobs->GetJob(&context, request, &answer);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

// A write succeeds or is refused at once with the reason.
void ExpectRoomOrRefusal(const grpc::Status& status) {
  if (status.ok()) return;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_EQ(testing::ReasonOfStatus(status), "STORAGE_FULL") << status.error_message();
}

grpc::Status TryCreate(TestClient& client, const v1::JobSpec& spec, std::string* name = nullptr) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
  v1::CreateJobRequest request;
  *request.mutable_spec() = spec;
  v1::Job job;
  const grpc::Status status = client.jobs->CreateJob(&context, request, &job);
  if (name != nullptr) *name = job.name();
  return status;
}

// The job ends in its state: complete, or failed for lack of space.
bool EndsWhole(TestClient& client, const std::string& name, const std::string& undisturbed) {
  const v1::Job job = client.WaitFinished(name);
  if (job.state() == v1::Job::STATE_SUCCEEDED) {
    EXPECT_EQ(ResultOf(client, name), undisturbed) << name;
    return true;
  }
  std::vector<v1::Job> jobs = client.Children(name);
  jobs.push_back(job);
  for (const v1::Job& one : jobs) {
    if (one.state() != v1::Job::STATE_FAILED) continue;
    EXPECT_EQ(ReasonOfJob(one), "STORAGE_FULL") << one.DebugString();
  }
  return false;
}

void Retry(TestClient& client, const std::string& name) {
  v1::RetryJobRequest request;
  request.set_name(name);
  grpc::ClientContext context;
  v1::Job job;
  const grpc::Status status = client.jobs->RetryJob(&context, request, &job);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

ChaosDiskTest::Outcome ChaosDiskTest::Endure(const std::string& reserve_mib,
                                             const std::string& low_space_mib,
                                             int64_t free_bytes) {
  Outcome outcome;
  ChaosService service(scratch_.path(),
                       {"--reserve-mib", reserve_mib, "--low-space-mib", low_space_mib});
  TestClient& client = service.client();
  const std::string scene = client.MakeScene().name();
  int seed = 0;
  const auto submit = [&] { return client.Create(ScriptedSpec(scene, kScript, ++seed)).name(); };
  const std::string first = submit();
  client.WaitFinished(first);
  const std::string undisturbed = ResultOf(client, first);

  std::vector<std::string> names;
  for (int i = 0; i < jobs_; ++i) names.push_back(submit());
  SleepMs(1000);
  for (int i = 0; i < 60; ++i) {
    Fill(free_bytes);  // fills space that is freed meanwhile
    ExpectAnAnswer(client, names[static_cast<size_t>(i) % names.size()]);
    if (i % 10 == 0) {
      const grpc::Status status = TryCreate(client, ScriptedSpec(scene, "steps=1", 100 + i));
      ExpectRoomOrRefusal(status);
      outcome.refused += status.ok() ? 0 : 1;
    }
    SleepMs(50);
  }
  if (free_bytes - kUploadBytes < (std::stoll(reserve_mib) << 20)) {
    EXPECT_THROW(client.Upload(std::string(kUploadBytes, 'u')), std::runtime_error);
  }
  fs::remove(filler_);

  for (const std::string& name : names) {
    if (EndsWhole(client, name, undisturbed)) continue;
    ++outcome.failed;
    Retry(client, name);
    EXPECT_TRUE(EndsWhole(client, name, undisturbed)) << "there is space again";
  }
  EXPECT_THAT(service.EndAndAudit(), IsEmpty());
  outcome.lost_attempts =
      static_cast<int>(service.Count("select count(*) from job_attempt where outcome='LOST'"));
  for (const auto& entry : fs::recursive_directory_iterator(disk_ / "blobs")) {
    EXPECT_NE(entry.path().extension(), ".part") << "a half-written blob was left";
  }
  std::cout << jobs_ << " jobs: " << outcome.failed << " failed with STORAGE_FULL and succeeded "
            << "when they were retried with space; " << outcome.lost_attempts << " attempts lost; "
            << outcome.refused << " of 6 submissions refused\n";
  return outcome;
}

TEST_F(ChaosDiskTest, JobsFailBelowReserveAndStoreStaysWritable) {
  // The store has room: its log grows to 4 MiB before a checkpoint.
  const Outcome outcome = Endure("12", "0", 8 << 20);
  EXPECT_GT(outcome.failed, 0) << "the disk was never full: the test proves nothing";
  EXPECT_EQ(outcome.lost_attempts, 0);
}

TEST_F(ChaosDiskTest, StartsNoJobWhenSpaceIsLow) {
  const Outcome outcome = Endure("1", "6", 4 << 20);
  EXPECT_EQ(outcome.failed, 0);
  EXPECT_GT(outcome.refused, 0) << "the mark was never reached: the test proves nothing";
}

TEST_F(ChaosDiskTest, FullDiskDelaysJobsAndAnswersReads) {
  const Outcome outcome = Endure("0", "0", 0);
  EXPECT_GT(outcome.failed + outcome.lost_attempts + outcome.refused, 0)
      << "the disk was never full: the test proves nothing";
}

class LargeDiskTest : public ChaosDiskTest {
 protected:
  LargeDiskTest() : ChaosDiskTest(kLargeDiskSize) {}
  int64_t Free() const { return static_cast<int64_t>(fs::space(disk_).available); }
};

// Largest possible scene, with paths of its own.
v1::CreateSceneRequest LargeScene(int number) {
  v1::CreateSceneRequest request;
  for (int i = 0; i < 2100; ++i) {
    v1::SceneFile* file = request.add_files();
    const std::string part = std::to_string(number) + "-" + std::to_string(i) + "-";
    file->set_path(part + std::string(230, 'a') + "/" + part + std::string(230, 'b') + "/" + part +
                   std::string(230, 'c') + "/" + part + std::string(230, 'd'));
    *file->mutable_digest() = testing::DigestOf(part);
  }
  return request;
}

template <typename Stub, typename Request, typename Response>
grpc::Status Answer(Stub& stub,
                    grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request,
                    Response* response) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  return (stub.*method)(&context, request, response);
}

TEST_F(LargeDiskTest, RowsKeepReserveAndCanBeDeletedOnFullDisk) {
  constexpr int64_t kReserve = 40 << 20, kLow = 60 << 20;
  ChaosService service(scratch_.path(), {"--reserve-mib", "40", "--low-space-mib", "60"});
  TestClient& client = service.client();
  using Scenes = v1::SceneService::Stub;
  const fs::path ballast = disk_ / "ballast";
  for (int i = 0; i < 200 && !fs::exists(ballast); ++i) SleepMs(50);
  ASSERT_TRUE(fs::exists(ballast));
  const v1::Scene photos = client.MakeScene();
  const std::string job = client.Create(ScriptedSpec(photos.name(), "steps=1")).name();
  client.WaitFinished(job);

  std::vector<std::string> scenes;
  grpc::Status status;
  while (scenes.size() < 190) {
    v1::Scene scene;
    status = Answer(
        *client.scenes, &Scenes::CreateScene, LargeScene(static_cast<int>(scenes.size())), &scene);
    if (!status.ok()) break;
    scenes.push_back(scene.name());
  }
  EXPECT_EQ(testing::ReasonOfStatus(status), "STORAGE_FULL") << scenes.size() << " scenes";
  EXPECT_GT(scenes.size(), 20u);
  EXPECT_GT(Free(), kReserve) << "what was created left the reserve";
  Fill(kLow);
  EXPECT_EQ(testing::ReasonOfStatus(TryCreate(client, ScriptedSpec(photos.name(), "steps=1", 2))),
            "STORAGE_FULL");

  // Without the space that the log of the store has already.
  SqliteDatabase(disk_ / "jobs.db", SqliteAccess::kWrite).Run("pragma wal_checkpoint(truncate)");
  Fill(0);
  v1::DeleteSceneRequest remove;
  v1::DeleteSceneResponse removed;
  remove.set_name(scenes.back());
  status = Answer(*client.scenes, &Scenes::DeleteScene, remove, &removed);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_FALSE(fs::exists(ballast)) << "it was given up: without it the disk was not full enough";
  v1::DeleteJobRequest remove_job;
  v1::DeleteJobResponse removed_job;
  remove_job.set_name(job);
  status = Answer(*client.jobs, &v1::JobService::Stub::DeleteJob, remove_job, &removed_job);
  EXPECT_TRUE(status.ok()) << status.error_message();
  scenes.pop_back();
  for (const std::string& scene : scenes) {
    remove.set_name(scene);
    status = Answer(*client.scenes, &Scenes::DeleteScene, remove, &removed);
    EXPECT_TRUE(status.ok()) << scene << ": " << status.error_message();
  }
  // The database returns their space while the filler remains.
  const auto wanted = static_cast<int64_t>(scenes.size()) << 20;
  for (int i = 0; i < 400 && Free() < wanted; ++i) SleepMs(50);
  EXPECT_GE(Free(), wanted);
  fs::remove(filler_);
  for (int i = 0; i < 400 && (!fs::exists(ballast) || Free() < kLow); ++i) SleepMs(50);
  EXPECT_TRUE(fs::exists(ballast)) << "there is room for it again";
  // The hold ends some seconds after a tenth more is free.
  std::string last;
  for (int i = 0; i < 200; ++i) {
    status = TryCreate(client, ScriptedSpec(photos.name(), "steps=1", 3), &last);
    if (status.ok()) break;
    SleepMs(50);
  }
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(client.WaitFinished(last).state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_THAT(service.EndAndAudit(), IsEmpty());
}

}  // namespace
}  // namespace color3d
