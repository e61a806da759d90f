#include "server/notify/notifier.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "server/notify/webhook.h"
#include "tests/support/service/http_receiver.h"
#include "tests/support/service/job_store_fixture.h"

namespace color3d {
namespace {
using std::chrono::milliseconds;

class Receiver : public testing::HttpReceiver {
 public:
  using testing::HttpReceiver::HttpReceiver;
  std::string url() const { return testing::HttpReceiver::url("/hook"); }
};

class NotifierTest : public JobStoreTest {
 protected:
  // A failed job with a pending notification.
  JobRecord EndedJob(const std::string& url) {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.notify_url = url;
    graph.jobs = {Job("single")};
    const JobRecord job = store_->CreateGraph(graph, {}, kNoLimit);
    FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
    return store_->GetJob(job.name);
  }
  NotifierOptions Options(const std::vector<std::string>& allowed) const {
    NotifierOptions options;
    options.allowed = allowed;
    options.secret = secret_;
    options.poll = milliseconds(5);
    options.pauses = {milliseconds(0)};
    options.silence = milliseconds(0);
    options.store_pause = milliseconds(5);
    return options;
  }
  std::unique_ptr<Notifier> Start(const std::vector<std::string>& allowed,
                                  int max_tries = NotifierOptions().max_tries) {
    NotifierOptions options = Options(allowed);
    options.max_tries = max_tries;
    return std::make_unique<Notifier>(
        *store_, [this] { return wall_.load(); }, options);
  }
  bool NoNotificationIsDue() {
    wall_ += int64_t{3600} * 1000;  // longer than any pause
    for (int i = 0; i < 1000 && store_->CountJobs().notifications > 0; ++i) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    return store_->CountJobs().notifications == 0;
  }

  const std::string secret_ = "secret of twenty-four by";
};

TEST_F(NotifierTest, RetriesUntilAcceptedAndSigns) {
  Receiver receiver({"500 Oops", "302 Found\r\nLocation: http://127.0.0.1:1/", "200 OK"});
  const JobRecord job = EndedJob(receiver.url());
  const auto notifier = Start({receiver.url()});
  ASSERT_TRUE(receiver.WaitFor(3));
  EXPECT_TRUE(NoNotificationIsDue());
  const auto requests = receiver.requests();
  EXPECT_EQ(requests.size(), 3u) << "not sent again once accepted";
  for (const Receiver::Request& request : requests) {
    EXPECT_EQ(request.line, "POST /hook HTTP/1.1");
    const std::string id = request.headers.at("webhook-id");
    EXPECT_EQ(id, requests[0].headers.at("webhook-id"));
    EXPECT_EQ(request.headers.at("webhook-signature"),
              WebhookSignature(
                  secret_, id, std::stoll(request.headers.at("webhook-timestamp")), request.body));
    const nlohmann::json body = nlohmann::json::parse(request.body);
    EXPECT_EQ(body.at("type"), "job.failed");
    EXPECT_EQ(body.at("data").at("name"), job.name);
    EXPECT_EQ(body.at("data").at("scene"), "scenes/test");
    EXPECT_EQ(body.at("data").at("error").at("reason"), "TEST");
  }
}

TEST_F(NotifierTest, RestartKeepsPendingNotifications) {
  Receiver hanging({"hang"}), good({"204 No Content"});
  EndedJob(hanging.url());
  {
    const auto notifier = Start({hanging.url()});
    ASSERT_TRUE(hanging.WaitFor(1));
    EndedJob(good.url());
  }  // returns at once, though an answer is pending
  EXPECT_EQ(store_->CountJobs().notifications, 2);
  Open();
  const auto notifier = Start({hanging.url(), good.url()});
  EXPECT_TRUE(good.WaitFor(1)) << "while another receiver hangs";
  EXPECT_TRUE(hanging.WaitFor(2));
}

TEST_F(NotifierTest, StopsAfterHttpGone) {
  Receiver receiver({"410 Gone"});
  EndedJob(receiver.url());
  const auto notifier = Start({receiver.url()});
  ASSERT_TRUE(receiver.WaitFor(1));
  EXPECT_TRUE(NoNotificationIsDue());
}

TEST_F(NotifierTest, GivesUpAfterMaxTries) {
  Receiver receiver(std::vector<std::string>(10, "500 Oops"));
  EndedJob(receiver.url());
  wall_ += int64_t{100} * 24 * 3600 * 1000;
  const auto notifier = Start({receiver.url()}, /*max_tries=*/3);
  EXPECT_TRUE(receiver.WaitFor(3)) << "a jump of the clock must not end the retries";
  EXPECT_TRUE(NoNotificationIsDue());
  EXPECT_EQ(receiver.requests().size(), 3u);
}

TEST_F(NotifierTest, SendsOnlyToAllowedTargets) {
  Receiver receiver({"200 OK"});
  EndedJob(receiver.url());
  const auto notifier = Start({"https://elsewhere.example.org"});
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_TRUE(receiver.requests().empty());
}

// A store that accepts no outcomes, like one on a full disk.
class FullStore : public SqliteJobStore {
 public:
  using SqliteJobStore::SqliteJobStore;
  void EndNotification(int64_t job_id, int64_t first_ms) override {
    RequireRoom();
    SqliteJobStore::EndNotification(job_id, first_ms);
  }
  void DelayNotification(int64_t job_id, int64_t first_ms, int64_t pause_ms) override {
    RequireRoom();
    SqliteJobStore::DelayNotification(job_id, first_ms, pause_ms);
  }
  bool WaitForTries(int count) const {
    for (int i = 0; i < 2000 && refused < count; ++i) std::this_thread::sleep_for(milliseconds(5));
    return refused >= count;
  }
  std::atomic<bool> is_full{true};
  std::atomic<int> refused{0};

 private:
  void RequireRoom() {
    if (!is_full) return;
    ++refused;
    throw ServiceError(ErrorReason::kStorageFull, "full");
  }
};

TEST_F(NotifierTest, FullDiskCausesNoDuplicates) {
  Receiver receiver({"200 OK"});
  StoreOptions store_options;
  store_options.boot_id = boot_id_;
  FullStore full(File(), StoreRole::kServer, TestClocks(), store_options);
  const JobRecord job = EndedJob(receiver.url());
  EndedJob(receiver.url());
  {
    const Notifier notifier(
        full, [this] { return wall_.load(); }, Options({receiver.url()}));
    ASSERT_TRUE(receiver.WaitFor(2));
    ASSERT_TRUE(full.WaitForTries(10)) << "retries to store the outcome";
    EXPECT_EQ(receiver.requests().size(), 2u);
    // Another end of the same job is another notification.
    wall_ += 1000;
    store_->Retry(job.name, false, {}, kNoLimit);
    FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
    ASSERT_TRUE(receiver.WaitFor(3));
    full.is_full = false;
    EXPECT_TRUE(NoNotificationIsDue()) << "the disk has room again";
  }
  EXPECT_EQ(receiver.requests().size(), 3u);
}

TEST_F(NotifierTest, FullDiskKeepsPausesAndMaxTries) {
  Receiver receiver({"500 Oops"});
  StoreOptions store_options;
  store_options.boot_id = boot_id_;
  FullStore full(File(), StoreRole::kServer, TestClocks(), store_options);
  EndedJob(receiver.url());
  NotifierOptions options = Options({receiver.url()});
  options.max_tries = 3;
  options.pauses = {milliseconds(100)};
  const auto begin = std::chrono::steady_clock::now();
  const Notifier notifier(
      full, [this] { return wall_.load(); }, options);
  ASSERT_TRUE(receiver.WaitFor(3));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(200));
  ASSERT_TRUE(full.WaitForTries(10));
  EXPECT_EQ(receiver.requests().size(), 3u) << "given up, and kept in memory";
}

TEST_F(NotifierTest, HangingReceiversDoNotDelayOthers) {
  std::vector<std::unique_ptr<Receiver>> hanging;
  std::vector<std::string> allowed;
  for (int i = 0; i < 3; ++i) {
    hanging.push_back(std::make_unique<Receiver>(std::vector<std::string>{"hang"}));
    allowed.push_back(hanging.back()->url());
    for (int k = 0; k < 6; ++k) EndedJob(hanging.back()->url());
  }
  Receiver good({"200 OK"});
  allowed.push_back(good.url());
  const auto notifier = Start(allowed);
  for (const auto& receiver : hanging) ASSERT_TRUE(receiver->WaitFor(2));
  for (int i = 0; i < 5; ++i) EndedJob(good.url());
  EXPECT_TRUE(good.WaitFor(5)) << "eighteen notifications wait for hanging receivers";
  for (const auto& receiver : hanging) EXPECT_EQ(receiver->requests().size(), 2u);
}

// Example of the specification's own libraries.
TEST(WebhookTest, SignatureMatchesSpecification) {
  ScratchFolder scratch;
  const auto file = scratch.path() / "secret";
  std::ofstream(file) << "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n";
  ::chmod(file.c_str(), 0600);
  EXPECT_EQ(WebhookSignature(ReadWebhookSecret(file),
                             "msg_p5jXN8AQM9LWM0D4loKWxJek",
                             1614265330,
                             "{\"test\": 2432232314}"),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
}

TEST(WebhookTest, RejectsBadSecrets) {
  ScratchFolder scratch;
  const auto file = scratch.path() / "secret";
  EXPECT_THROW(ReadWebhookSecret(file), Error);
  for (const char* text :
       {"", "short", "AAAA", "not base64 at all, but long enough to be one!!!"}) {
    std::ofstream(file) << text;
    ::chmod(file.c_str(), 0600);
    EXPECT_THROW(ReadWebhookSecret(file), Error) << text;
  }
  std::ofstream(file) << "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";
  ::chmod(file.c_str(), 0640);
  EXPECT_THROW(ReadWebhookSecret(file), Error) << "readable by others";
}

}  // namespace
}  // namespace color3d
