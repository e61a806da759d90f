#include "server/metrics/server_metrics.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <regex>
#include <set>

#include "server/storage/file_blob_store.h"
#include "tests/support/service/job_store_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

// Returns the answer to one GET, including its headers.
std::string Get(int port, const std::string& path) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string answer;
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) {
    const std::string request = "GET " + path + " HTTP/1.0\r\n\r\n";
    EXPECT_EQ(::write(fd, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    char bytes[4096];
    for (ssize_t got = 0; (got = ::read(fd, bytes, sizeof(bytes))) > 0;) {
      answer.append(bytes, static_cast<size_t>(got));
    }
  }
  ::close(fd);
  return answer;
}

class ServerMetricsTest : public JobStoreTest {
 protected:
  int Listen() {
    return metrics_.Listen("127.0.0.1:0", *store_, blobs_, [this] { return sample_; });
  }
  // Returns the value of a line "NAME{LABELS} VALUE", or -1 if there is none.
  static double ValueOf(const std::string& text, const std::string& series) {
    const size_t at = text.find("\n" + series + " ");
    return at == std::string::npos ? -1.0 : std::stod(text.substr(at + series.size() + 2));
  }

  FileBlobStore blobs_{scratch_.path() / "blobs", {0}};
  ServerSample sample_;
  ServerMetrics metrics_{"1.2.3"};
};

TEST_F(ServerMetricsTest, ReportsQueueCallsAndFinishedJobs) {
  const int port = Listen();
  CreateSingle();
  Succeed(ClaimOne());
  FailWith((CreateSingle(), ClaimOne()), ErrorCode::kInvalidArgument);
  CreateDiamond();
  store_->SetHold(Hold::kPaused, true);
  store_->UpdateWorker({"w", 1, "", 0, 0});
  store_->UpdateWorker({"inference-2", 2, "", 0, 0});
  metrics_.CountCall("/color3d.v1.JobService/GetJob", "OK", 0.003);
  metrics_.CountCall("/color3d.v1.JobService/GetJob", "NOT_FOUND", 0.2);
  sample_.blobs_damaged = 7;
  sample_.certificate_end_s = 1'900'000'000;
  for (int look = 0; look < 2; ++look) {  // a second scrape counts nothing twice
    const std::string text = Get(port, "/metrics");
    EXPECT_EQ(ValueOf(text, "color3d_jobs{state=\"queued\"}"), 1) << text;
    EXPECT_EQ(ValueOf(text, "color3d_jobs{state=\"blocked\"}"), 3);
    EXPECT_EQ(ValueOf(text, "color3d_jobs_ended_total{kind=\"single\",state=\"SUCCEEDED\"}"), 1);
    EXPECT_EQ(ValueOf(text, "color3d_jobs_ended_total{kind=\"single\",state=\"FAILED\"}"), 1);
    EXPECT_EQ(ValueOf(text, "color3d_queue_held{reason=\"paused\"}"), 1);
    EXPECT_EQ(ValueOf(text, "color3d_workers{state=\"idle\"}"), 1);
    EXPECT_EQ(ValueOf(text, "color3d_workers{state=\"live\"}"), 1)
        << "inference workers claim no jobs";
    EXPECT_EQ(ValueOf(text, "color3d_blobs_damaged_total"), 7);
    EXPECT_EQ(ValueOf(text, "color3d_build_info{version=\"1.2.3\"}"), 1);
    EXPECT_EQ(ValueOf(text,
                      "color3d_rpc_calls_total{code=\"NOT_FOUND\",method=\"color3d.v1.JobService/"
                      "GetJob\"}"),
              1);
    EXPECT_EQ(ValueOf(text, "color3d_rpc_seconds_count{method=\"color3d.v1.JobService/GetJob\"}"),
              2);
  }
  EXPECT_NE(Get(port, "/").find("404"), std::string::npos);
  metrics_.StopListening();
  EXPECT_EQ(Get(port, "/metrics"), "");
}

// Silent connections are closed one after the other, and the next scrape is answered.
TEST_F(ServerMetricsTest, SilentConnectionsDoNotBlockScrapes) {
  const int port = Listen();
  std::vector<int> silent;
  for (int i = 0; i < 100; ++i) {
    silent.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(::connect(silent.back(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  const auto start = std::chrono::steady_clock::now();
  EXPECT_NE(Get(port, "/metrics").find("color3d_jobs"), std::string::npos);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  for (const int fd : silent) ::close(fd);
  EXPECT_NE(Get(port, "/metrics").find("color3d_jobs"), std::string::npos);
}

TEST_F(ServerMetricsTest, NamesAddressInUse) {
  const int port = Listen();
  ServerMetrics other("1");
  const std::string address = "127.0.0.1:" + std::to_string(port);
  try {
    other.Listen(address, *store_, blobs_, [] { return ServerSample(); });
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find(address), std::string::npos);
  }
}

// All metrics used by dashboard and alerts exist.
TEST_F(ServerMetricsTest, MetricsOfDashboardAndAlertsExist) {
  CreateSingle();
  const int port = Listen();
  Succeed(ClaimOne());
  metrics_.CountCall("/a.B/C", "OK", 0.1);
  sample_.certificate_end_s = 1;
  const std::string text = Get(port, "/metrics");
  std::set<std::string> asked;
  const std::regex name("color3d_[a-z_]+[a-z]");
  for (const fs::directory_entry& entry : fs::directory_iterator(COLOR3D_MONITORING)) {
    const std::string file = ReadFile(entry.path());
    for (std::sregex_iterator it(file.begin(), file.end(), name), end; it != end; ++it) {
      asked.insert(it->str());
    }
  }
  EXPECT_GE(asked.size(), 20u);
  for (const std::string& metric : asked) {
    EXPECT_TRUE(text.find("\n" + metric + "{") != std::string::npos ||
                text.find("\n" + metric + " ") != std::string::npos)
        << metric;
  }
}

}  // namespace
}  // namespace color3d
