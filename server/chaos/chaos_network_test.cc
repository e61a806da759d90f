// Clients reach the service over a network that cuts, delays and drops data, while workers and
// servers are killed: clients that retry get each result, once. COLOR3D_CHAOS_JOBS and _SEED; label
// "chaos".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <thread>

#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/scene_upload.h"
#include "core/base/files.h"
#include "tests/support/service/chaos_service.h"
#include "tests/support/service/cutting_proxy.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using client::Connection;
using client::UploadFile;
using testing::ChaosSeed;
using testing::ChaosService;
using testing::CuttingProxy;
using testing::FromEnvironment;
using ::testing::IsEmpty;
using testing::ScriptedSpec;

constexpr int kClients = 8;
constexpr int64_t kPhotoBytes = 900'000;
constexpr char kScript[] = "steps=8,ms=150";

// A different photo for each job: bytes after the end of a PNG are ignored.
std::string PhotoOf(int job) {
  std::string bytes = testing::TinyPng();
  Random random(static_cast<uint64_t>(job) + 1);
  while (static_cast<int64_t>(bytes.size()) < kPhotoBytes) {
    bytes += static_cast<char>(random.NextUint32() >> 24);
  }
  return bytes;
}

// A user of the client library who retries after each lost connection.
class User {
 public:
  User(const std::string& address, const fs::path& folder)
      : folder_(folder), connection_({.address = address}, never_) {}

  // Uploads a scene, submits a job twice, watches it and downloads its results. Throws on failure.
  void Do(int number) {
    const UploadFile photo = Write(PhotoOf(number));
    client::UploadMissing(connection_, {photo}, [](int64_t, int64_t) {});
    v1::CreateJobRequest request;
    *request.mutable_spec() = ScriptedSpec(MakeScene(photo), kScript, number);
    request.set_request_id(client::NewUuid());
    const std::string name = Create(request);
    if (Create(request) != name) throw std::runtime_error("one request made two jobs");
    client::WatchJobs(
        connection_, {name}, [](const v1::JobEvent&) {}, [] { return true; });
    const v1::Job job = client::GetJob(connection_, name);
    if (job.state() != v1::Job::STATE_SUCCEEDED) throw std::runtime_error(job.DebugString());
    for (const v1::Artifact& artifact : job.artifacts()) {
      Take({artifact.digest().sha256(), artifact.digest().size_bytes()});
    }
    Take(photo.digest);
  }

 private:
  UploadFile Write(const std::string& bytes) {
    WriteFileAtomic(folder_ / "photo.png", bytes);
    return {folder_ / "photo.png", DigestFile(folder_ / "photo.png")};
  }
  std::string MakeScene(const UploadFile& photo) {
    v1::CreateSceneRequest create;
    create.set_request_id(client::NewUuid());
    for (const char* path : {"images/a.png", "images/b.png"}) {
      v1::SceneFile* file = create.add_files();
      file->set_path(path);
      *file->mutable_digest() = client::ToProto(photo.digest);
    }
    v1::CommitSceneRequest commit;
    commit.set_name(
        connection_.Call(&v1::SceneService::Stub::CreateScene, connection_.scenes(), create)
            .name());
    commit.set_request_id(client::NewUuid());
    return connection_.Call(&v1::SceneService::Stub::CommitScene, connection_.scenes(), commit)
        .name();
  }
  std::string Create(const v1::CreateJobRequest& request) {
    return connection_.Call(&v1::JobService::Stub::CreateJob, connection_.jobs(), request).name();
  }
  // DownloadBlob verifies the digest.
  void Take(const FileDigest& digest) {
    client::DownloadBlob(connection_, digest, folder_ / digest.sha256, [](int64_t) {});
    fs::remove(folder_ / digest.sha256);
  }

  CancellationToken never_;
  const fs::path folder_;
  Connection connection_;
};

// A connection attempt ends after four seconds, which a restarting server may need: retried.
std::unique_ptr<User> Come(const std::string& address, const fs::path& folder) {
  for (int tries = 0;; ++tries) {
    try {
      return std::make_unique<User>(address, folder);
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kUnavailable || tries == 10) throw;
    }
  }
}

std::string DescribeFates(const std::vector<std::unique_ptr<CuttingProxy>>& proxies) {
  std::map<std::string, int> sum;
  for (const auto& proxy : proxies) {
    for (const auto& [name, count] : proxy->Fates()) sum[name] += count;
  }
  std::string text;
  for (const auto& [name, count] : sum) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " x " + name;
  }
  return text;
}

TEST(ChaosNetworkTest, ClientsGetAllResultsThroughBadNetwork) {
  const ScratchFolder scratch;
  const int jobs = static_cast<int>(FromEnvironment("COLOR3D_CHAOS_JOBS", 100));
  const uint64_t seed = ChaosSeed();
  Random random(seed);
  const auto begun = std::chrono::steady_clock::now();
  ChaosService service(scratch.path());
  // One proxy each: gRPC shares connections to one address within a process.
  std::vector<std::unique_ptr<CuttingProxy>> proxies;
  const auto follow = [&] {
    for (const auto& proxy : proxies) proxy->SetTarget(service.server().address());
  };
  for (uint64_t i = 0; i < kClients; ++i) {
    proxies.push_back(std::make_unique<CuttingProxy>(seed + i));
  }
  follow();
  std::atomic<int> next{0}, at_work{kClients};
  std::mutex mutex;
  std::vector<std::string> failures;
  std::vector<std::thread> users;
  for (int i = 0; i < kClients; ++i) {
    users.emplace_back([&,
                        address = proxies[static_cast<size_t>(i)]->address(),
                        folder = scratch.path() / ("user" + std::to_string(i))] {
      fs::create_directories(folder);
      for (int number = next++; number < jobs; number = next++) {
        try {
          Come(address, folder)->Do(number);
        } catch (const std::exception& e) {
          std::lock_guard lock(mutex);
          failures.push_back("job " + std::to_string(number) + ": " + e.what());
        }
      }
      --at_work;
    });
  }
  while (at_work > 0) {
    testing::SleepMs(1000 + static_cast<int>(random.NextBelow(3000)));
    service.Disturb(random);
    follow();
  }
  for (std::thread& user : users) user.join();
  EXPECT_THAT(failures, IsEmpty());
  EXPECT_THAT(service.EndAndAudit(), IsEmpty());
  EXPECT_EQ(service.Count("select count(*) from job where kind='select_key_view'"), jobs)
      << "a request that was sent again made another job";
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::cout << jobs << " submissions of " << kClients
            << " clients; connections: " << DescribeFates(proxies) << "; " << service.Faults()
            << "; " << failures.size() << " losses, " << seconds << " s\n";
}

}  // namespace
}  // namespace color3d
