// A server under load must not grow: jobs, uploads, downloads, watches, abandoned calls, live
// pictures. COLOR3D_SOAK_SECONDS: duration (3600). Label "soak".
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "core/base/files.h"
#include "core/base/median.h"
#include "tests/support/service/chaos_service.h"
#include "tests/support/service/process_sizes.h"

namespace color3d {
namespace {
using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::ProcessSizes;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::SleepMs;
using testing::TestClient;

constexpr int kSamples = 400;
constexpr int64_t kFlatAfterS = 300;  // a new server still fills its caches
constexpr double kAllowanceMib = 4.0, kFirstAllowanceMib = 24.0;
constexpr size_t kKeptJobs = 200;  // older ones are deleted
constexpr size_t kUploadBytes = 20'000;

// Clients on separate threads until the end of the test.
class Busy {
 public:
  Busy(ServerProcess& server, const std::string& scene) : server_(server), scene_(scene) {
    Repeat(100, [this](TestClient& client, Random& random) { Submit(client, random); });
    Repeat(200, [this](TestClient& client, Random& random) { Transfer(client, random); });
    for (int i = 0; i < 4; ++i) {
      Repeat(50, [this](TestClient& client, Random& random) { Watch(client, random); });
    }
    Repeat(50, [this](TestClient& client, Random& random) { GiveUp(client, random); });
    Repeat(500, [this](TestClient& client, Random&) { ColorPicture(client); });
  }
  // Returns failures.
  std::vector<std::string> End() {
    is_over_ = true;
    for (std::thread& thread : threads_) thread.join();
    return failures_;
  }
  std::string Counts() const {
    return std::to_string(submitted_) + " submissions, " + std::to_string(transfers_) +
           " uploads and downloads, " + std::to_string(watches_) + " watches, " +
           std::to_string(given_up_) + " calls given up, " + std::to_string(pictures_) +
           " live pictures";
  }

 private:
  using Deed = std::function<void(TestClient&, Random&)>;

  // About every `pause_ms`; each hundredth time on a new connection.
  void Repeat(int pause_ms, const Deed& deed) {
    threads_.emplace_back([this, pause_ms, deed, seed = threads_.size()] {
      Random random(seed);
      while (!is_over_) {
        TestClient client(server_.address());
        for (int i = 0; i < 100 && !is_over_; ++i) {
          try {
            deed(client, random);
          } catch (const std::exception& e) {
            std::lock_guard lock(mutex_);
            if (failures_.size() < 10) failures_.push_back(e.what());
          }
          SleepMs(static_cast<int>(random.NextBelow(static_cast<uint32_t>(2 * pause_ms))));
        }
      }
    });
  }

  void Submit(TestClient& client, Random& random) {
    const int seed = ++submitted_;
    const std::string name = client.Create(ScriptedSpec(scene_, "steps=3,ms=10", seed)).name();
    std::string oldest;
    {
      std::lock_guard lock(mutex_);
      jobs_.push_back(name);
      if (jobs_.size() > kKeptJobs) {
        oldest = jobs_.front();
        jobs_.pop_front();
      }
    }
    v1::Job job;
    if (random.NextBelow(5) == 0) {
      v1::CancelJobRequest cancel;
      cancel.set_name(name);
      grpc::ClientContext context;
      client.jobs->CancelJob(&context, cancel, &job);
    }
    if (oldest.empty()) return;
    v1::DeleteJobRequest remove;
    remove.set_name(oldest);
    grpc::ClientContext context;
    v1::DeleteJobResponse none;
    client.jobs->DeleteJob(&context, remove, &none);
  }

  void Transfer(TestClient& client, Random& random) {
    std::string bytes(kUploadBytes, 'x');
    for (char& byte : bytes) byte = static_cast<char>(random.NextUint32() >> 24);
    const v1::Digest digest = client.Upload(bytes);
    if (client.Download(digest) != bytes) throw std::runtime_error("other bytes came back");
    ++transfers_;
  }

  // Some watches see the end of the job, most are cancelled.
  void Watch(TestClient& client, Random& random) {
    v1::WatchJobsRequest request;
    request.add_names(AnyJob(random));
    if (request.names(0).empty()) return;
    grpc::ClientContext context;
    const auto stream = client.jobs->WatchJobs(&context, request);
    v1::JobEvent event;
    for (uint32_t left = random.NextBelow(4); left > 0 && stream->Read(&event); --left) continue;
    if (random.NextBelow(4) > 0) context.TryCancel();
    while (stream->Read(&event)) continue;
    stream->Finish();
    ++watches_;
  }

  // Calls with an expired deadline, and an upload that is abandoned.
  void GiveUp(TestClient& client, Random& random) {
    grpc::ClientContext listing;
    listing.set_deadline(std::chrono::system_clock::now() + milliseconds(random.NextBelow(3)));
    v1::ListJobsResponse jobs;
    client.jobs->ListJobs(&listing, {}, &jobs);
    grpc::ClientContext writing;
    const v1::Digest digest = testing::DigestOf(std::string(kUploadBytes, 'h'));
    google::bytestream::WriteRequest request;
    request.set_resource_name("uploads/half/blobs/" + digest.sha256() + "/" +
                              std::to_string(digest.size_bytes()));
    request.set_data(std::string(100, 'h'));
    google::bytestream::WriteResponse response;
    const auto stream = client.bytes->Write(&writing, &response);
    stream->Write(request);
    writing.TryCancel();
    stream->Finish();
    ++given_up_;
  }

  void ColorPicture(TestClient& client) {
    v1::ColorizeImagesRequest request;
    request.set_request_id("1");
    *request.mutable_example() = client.Upload("example");
    request.set_image("picture");
    grpc::ClientContext context;
    const auto stream = client.colorizers->ColorizeImages(&context);
    stream->Write(request);
    stream->WritesDone();
    v1::ColorizeImagesResponse answer;
    while (stream->Read(&answer)) pictures_ += answer.image().empty() ? 0 : 1;
    stream->Finish();
  }

  std::string AnyJob(Random& random) {
    std::lock_guard lock(mutex_);
    return jobs_.empty() ? "" : jobs_[random.NextBelow(static_cast<uint32_t>(jobs_.size()))];
  }

  ServerProcess& server_;
  const std::string scene_;
  std::atomic<bool> is_over_{false};
  std::atomic<int> submitted_{0}, transfers_{0}, watches_{0}, given_up_{0}, pictures_{0};
  std::mutex mutex_;
  std::deque<std::string> jobs_;
  std::vector<std::string> failures_;
  std::vector<std::thread> threads_;
};

// Medians of the second and of the last quarter.
struct Trend {
  double before = 0.0, after = 0.0;
};

Trend TrendOf(const std::vector<ProcessSizes>& samples, double ProcessSizes::*size) {
  const auto quarter = [&](size_t index) {
    std::vector<double> values;
    for (size_t i = index * samples.size() / 4; i < (index + 1) * samples.size() / 4; ++i) {
      values.push_back(samples[i].*size);
    }
    return Median(values);
  };
  return {quarter(1), quarter(3)};
}

void ExpectFlat(const char* whose, const std::vector<ProcessSizes>& samples, double allowance_mib) {
  const auto check = [&](const char* what, double ProcessSizes::*size, double allowance) {
    const Trend trend = TrendOf(samples, size);
    std::cout << whose << ", " << what << ": " << trend.before << ", then " << trend.after << "\n";
    EXPECT_LE(trend.after, trend.before * 1.05 + allowance) << whose << ": more and more " << what;
  };
  check("resident MiB", &ProcessSizes::resident_mib, allowance_mib);
  check("descriptors", &ProcessSizes::descriptors, 8.0);
  check("threads", &ProcessSizes::threads, 4.0);
}

TEST(SoakTest, BusyServerDoesNotGrow) {
  const int64_t seconds = testing::FromEnvironment("COLOR3D_SOAK_SECONDS", 3600);
  const ScratchFolder scratch;
  ServerProcess server(scratch.path(),
                       {"--log-level", "off", "--lease-seconds", "20", "--heartbeat-seconds", "1"},
                       /*workers=*/2);
  Busy busy(server, server.client().MakeScene().name());
  std::vector<ProcessSizes> of_server, of_workers;
  const auto begun = steady_clock::now();
  for (int i = 0; i < kSamples; ++i) {
    std::this_thread::sleep_until(begun + i * duration<double>(seconds) / kSamples);
    of_server.push_back(testing::SizesOf({server.pid()}));
    std::vector<pid_t> workers = server.Workers();
    for (const pid_t worker : server.Workers(/*inference=*/true)) workers.push_back(worker);
    of_workers.push_back(testing::SizesOf(workers));
  }
  const std::vector<std::string> failures = busy.End();
  EXPECT_TRUE(failures.empty()) << failures.front();
  std::cout << seconds << " s: " << busy.Counts() << "\n";
  const double allowance_mib = seconds < kFlatAfterS ? kFirstAllowanceMib : kAllowanceMib;
  ExpectFlat("server", of_server, allowance_mib);
  ExpectFlat("workers", of_workers, allowance_mib);
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
}

}  // namespace
}  // namespace color3d
