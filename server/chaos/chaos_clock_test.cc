// The wall clock jumps by days while the service runs: nothing is lost, late or collected. Requires
// libfaketime (Debian: faketime). COLOR3D_CHAOS_JOBS: number of jobs (6). Label "chaos".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>
#include <fstream>

#include "core/base/files.h"
#include "tests/support/service/chaos_service.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::ChaosService;
using testing::Fault;
using ::testing::IsEmpty;
using testing::ScriptedSpec;
using testing::SleepMs;
using testing::TestClient;

constexpr int kDay = 24 * 3600;

fs::path FindLibrary() {
  for (const auto& folder : fs::directory_iterator("/usr/lib")) {
    const fs::path file = folder.path() / "faketime" / "libfaketimeMT.so.1";
    std::error_code none;
    if (fs::exists(file, none)) return file;
  }
  return {};
}

// Changes the wall clock of programs started during its lifetime, but not their steady clock and
// file times.
class WallClock {
 public:
  WallClock(const fs::path& library, const fs::path& file) : file_(file) {
    Jump(0);
    ::setenv("LD_PRELOAD", library.c_str(), 1);
    ::setenv("FAKETIME_TIMESTAMP_FILE", file_.c_str(), 1);
    for (const char* name : kSwitches) ::setenv(name, "1", 1);
  }
  ~WallClock() {
    ::unsetenv("LD_PRELOAD");
    ::unsetenv("FAKETIME_TIMESTAMP_FILE");
    for (const char* name : kSwitches) ::unsetenv(name);
  }
  void Jump(int seconds) {
    WriteFileAtomic(file_, (seconds < 0 ? "" : "+") + std::to_string(seconds) + "\n");
  }

 private:
  static constexpr const char* kSwitches[] = {
      "FAKETIME_DONT_FAKE_MONOTONIC", "DONT_FAKE_MONOTONIC", "FAKETIME_NO_CACHE", "NO_FAKE_STAT"};
  const fs::path file_;
};

class ChaosClockTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (library_.empty()) {
      GTEST_SKIP() << "JUMPS OF THE CLOCK WERE NOT TESTED: install the package faketime";
    }
  }

  // A half-finished upload.
  static std::string BeginUpload(TestClient& client, const std::string& content) {
    const v1::Digest digest = testing::DigestOf(content);
    google::bytestream::WriteRequest request;
    request.set_resource_name("uploads/half/blobs/" + digest.sha256() + "/" +
                              std::to_string(digest.size_bytes()));
    request.set_data(content.substr(0, content.size() / 2));
    grpc::ClientContext context;
    google::bytestream::WriteResponse response;
    const auto stream = client.bytes->Write(&context, &response);
    stream->Write(request);
    stream->WritesDone();
    stream->Finish();
    return request.resource_name();
  }
  static int64_t Committed(TestClient& client, const std::string& resource) {
    google::bytestream::QueryWriteStatusRequest request;
    request.set_resource_name(resource);
    google::bytestream::QueryWriteStatusResponse response;
    grpc::ClientContext context;
    client.bytes->QueryWriteStatus(&context, request, &response);
    return response.committed_size();
  }

  const fs::path library_ = FindLibrary();
  ScratchFolder scratch_;
};

TEST_F(ChaosClockTest, ClockJumpsEndNoLeaseAndCollectNothing) {
  WallClock wall(library_, scratch_.path() / "offset");
  // Long enough for a busy machine, shorter than a jump.
  ChaosService service(scratch_.path(), {"--lease-seconds", "20", "--heartbeat-seconds", "0.5"});
  const std::string scene = service.client().MakeScene().name();
  const std::string unnamed = "nothing names this yet";
  const v1::Digest digest = service.client().Upload(unnamed);
  const std::string content(100'000, 'h');
  const std::string upload = BeginUpload(service.client(), content);
  std::vector<std::string> names;
  const auto begun = std::chrono::steady_clock::now();
  const int jobs = static_cast<int>(testing::FromEnvironment("COLOR3D_CHAOS_JOBS", 6));
  for (int i = 0; i < jobs; ++i) {
    const char* script = i % 2 == 0 ? "steps=25,ms=100" : "steps=25,ms=100,unavailable_once";
    names.push_back(service.client().Create(ScriptedSpec(scene, script, i + 1)).name());
  }
  int jumps = 0;
  bool was_told = false;
  for (const int seconds : {kDay + 3600, 0, -kDay, 3 * kDay, 0, 40 * kDay, 0}) {
    SleepMs(700);
    wall.Jump(seconds);
    ++jumps;
    const v1::Job job = service.client().Create(ScriptedSpec(scene, "steps=1", 100 + jumps));
    const int64_t off = job.create_time().seconds() - std::time(nullptr) - seconds;
    was_told |= seconds != 0 && std::abs(off) < 60;
    names.push_back(job.name());
  }
  EXPECT_TRUE(was_told) << "the server's clock did not jump: the test proves nothing";
  for (const std::string& name : names) {
    const v1::Job job = service.client().WaitFinished(name, 30);
    EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.DebugString();
    EXPECT_LE(job.attempt(), 2);
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
  EXPECT_EQ(service.Count("select count(*) from job_attempt where outcome='LOST'"), 0);

  // A starting server sweeps at once.
  Random random(1);
  for (const int jump : {2 * kDay, -2 * kDay, 0}) {
    wall.Jump(jump);
    service.Disturb(random, {Fault::kServerRestarted});
    SleepMs(1000);
    EXPECT_EQ(service.client().Download(digest), unnamed);
    EXPECT_EQ(Committed(service.client(), upload), static_cast<int64_t>(content.size() / 2))
        << "an upload that goes on was collected";
  }
  EXPECT_THAT(service.EndAndAudit(), IsEmpty());
  std::cout << jumps << " jumps, " << names.size() << " jobs in " << seconds.count()
            << " s, no lease lost\n";
}

}  // namespace
}  // namespace color3d
