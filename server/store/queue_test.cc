// Queue of the job store: holds, equal work, deletion of old jobs.
#include <gtest/gtest.h>

#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {
class QueueTest : public AnyStoreTest {};
COLOR3D_FOR_ALL_STORES(QueueTest);

TEST_P(QueueTest, HeldQueueGivesNoJobAndReason) {
  const JobRecord job = CreateSingle();
  store_->UpdateWorker({"w", 1, "", 0, 0});
  for (const Hold hold : {Hold::kPaused, Hold::kStorage}) {
    store_->SetHold(hold, true);
    EXPECT_FALSE(store_->Claim("w", kLease).has_value());
    ClaimTerms for_batch{.worker = "w", .lease_ms = kLease};
    for_batch.batch_kind = "single";
    EXPECT_FALSE(store_->Claim(for_batch));
    EXPECT_NE(store_->PlaceInQueue(job).waits_for, "");
    Open();
    EXPECT_EQ(store_->Holds().count(hold), 1u) << "over a restart, too";
    store_->SetHold(hold, false);
  }
  EXPECT_EQ(store_->PlaceInQueue(job).waits_for, "");
  EXPECT_EQ(ClaimOne().name, job.name);
}

TEST_P(QueueTest, WaitingJobHasPlaceAndTime) {
  const JobRecord first = CreateSingle(), second = CreateSingle();
  const JobRecord root = CreateDiamond();
  EXPECT_EQ(store_->PlaceInQueue(first).waits_for, "a worker; none is running");
  store_->UpdateWorker({"w", 1, "", 0, 0});
  EXPECT_EQ(store_->PlaceInQueue(first).position, 1);
  EXPECT_EQ(store_->PlaceInQueue(second).position, 2);
  EXPECT_EQ(store_->PlaceInQueue(root).position, 3) << "that of its first stage";
  EXPECT_EQ(store_->PlaceInQueue(Child(root, "left")).position, 0) << "waits for an input";
  wall_ += 700;
  FailWith(ClaimOne(), ErrorCode::kUnavailable);
  const JobRecord waiting = store_->GetJob(first.name);
  EXPECT_EQ(waiting.queued_ms, 700);
  EXPECT_EQ(store_->PlaceInQueue(waiting).waits_for, "its next attempt, in 1 s");
  wall_ += 300;
  now_ += 1000;
  const JobRecord running = ClaimOne();
  EXPECT_EQ(running.queued_ms, 1000);
  EXPECT_EQ(store_->PlaceInQueue(running).position, 0);
  EXPECT_EQ(store_->PlaceInQueue(second).position, 1);
}

TEST_P(QueueTest, RunsEqualWorkOnce) {
  CreateSingle();
  CreateSingle();
  store_->UpdateWorker({"w", 1, "", 0, 0});
  const JobRecord leader = ClaimOne(), follower = ClaimOne();
  EXPECT_FALSE(store_->JoinEqual(LeaseOf(leader), "key"));
  EXPECT_TRUE(store_->JoinEqual(LeaseOf(follower), "key"));
  const JobRecord waiting = store_->GetJob(follower.name);
  EXPECT_EQ(waiting.state, JobState::kQueued);
  EXPECT_EQ(waiting.attempt, 0) << "nothing was spent";
  EXPECT_NE(store_->PlaceInQueue(waiting).waits_for.find("equal work"), std::string::npos);
  EXPECT_FALSE(store_->Claim("w", kLease).has_value());
  Succeed(leader);
  const JobRecord again = ClaimOne();
  EXPECT_EQ(again.name, follower.name);
  EXPECT_FALSE(store_->JoinEqual(LeaseOf(again), "key")) << "nobody else does it now";
}

TEST_P(QueueTest, WaitingJobRunsWhenEqualJobFails) {
  for (const char* end : {"fails", "is lost", "is cancelled", "is killed"}) {
    SCOPED_TRACE(end);
    const JobRecord first = CreateSingle(), second = CreateSingle();
    const JobRecord leader = ClaimOne(), follower = ClaimOne();
    store_->JoinEqual(LeaseOf(leader), "key");
    ASSERT_TRUE(store_->JoinEqual(LeaseOf(follower), "key"));
    if (end == std::string("fails")) FailWith(leader, ErrorCode::kInvalidArgument);
    if (end == std::string("is lost")) {
      now_ += 2 * kLease;
      store_->ReapExpired();
    }
    if (end == std::string("is cancelled")) {
      store_->Cancel(leader.name, {});
      FailWith(leader, ErrorCode::kCancelled);
    }
    if (end == std::string("is killed")) store_->Kill(leader.name);
    const JobRecord again = ClaimOne();
    EXPECT_EQ(again.name, second.name);
    Succeed(again, std::string("of ") + end);
    store_->Kill(first.name);
  }
}

TEST_P(QueueTest, CancelledJobDoesNotWaitForEqualWork) {
  CreateSingle();
  const JobRecord root = CreateSingle();
  const JobRecord leader = ClaimOne(), follower = ClaimOne();
  store_->JoinEqual(LeaseOf(leader), "key");
  store_->Cancel(root.name, {});
  EXPECT_TRUE(store_->JoinEqual(LeaseOf(follower), "key"));
  EXPECT_EQ(StateOf(root.name), JobState::kCancelled);
  store_->Retry(root.name, false, {}, kNoLimit);
  EXPECT_FALSE(store_->Heartbeat(LeaseOf(ClaimOne()), {}, {}, kLease).cancel_requested)
      << "the retry is another wish";
}

TEST_P(QueueTest, KilledJobEndsAtOnce) {
  const JobRecord root = CreateDiamond();
  const JobRecord running = ClaimOne();
  EXPECT_EQ(store_->Kill(root.name).state, JobState::kCancelled);
  for (const JobRecord& child : store_->ListChildren(root.name)) {
    EXPECT_EQ(child.state, JobState::kCancelled) << child.kind;
  }
  EXPECT_EQ(ReasonThrown([&] { Succeed(running); }), "LEASE_LOST");
  EXPECT_EQ(store_->Kill(root.name).state, JobState::kCancelled) << "twice is once";
  EXPECT_EQ(store_->Retry(root.name, false, {}, kNoLimit).state, JobState::kBlocked);
}

TEST_P(QueueTest, DeletesOldJobsInTwoPhases) {
  constexpr int64_t kGrace = 1000;
  CreateSingle();
  const JobRecord old = ClaimOne();
  Succeed(old);
  const JobRecord pinned = CreateSingle();
  Succeed(ClaimOne());
  store_->Pin(pinned.name, true);
  const auto expired = [&](int64_t before) { return store_->AgeExpired(before, kGrace); };
  EXPECT_TRUE(expired(wall_ + (int64_t{1} << 40)).empty()) << "the clock jumped: noted only";
  now_ += kGrace;
  EXPECT_TRUE(expired(wall_).empty()) << "the clock was set right: forgotten";
  now_ += kGrace;
  wall_ += 10;
  EXPECT_TRUE(expired(wall_).empty());
  now_ += kGrace;
  EXPECT_EQ(expired(wall_), std::vector<std::string>{old.name});
  NewGraph reader;
  reader.scene = "scenes/test";
  reader.jobs = {Job("reader")};
  reader.jobs[0].input_jobs = {old.name};
  store_->CreateGraph(reader, {}, kNoLimit);
  EXPECT_TRUE(expired(wall_).empty()) << "it is read";
  EXPECT_EQ(ReasonThrown([&] { store_->Pin(Child(CreateDiamond(), "left").name, true); }),
            "INVALID_ARGUMENT");
}

TEST_P(QueueTest, DeletesUnusedScenesInTwoPhases) {
  constexpr int64_t kGrace = 1000;
  SceneRecord abandoned;
  abandoned.name = "scenes/abandoned";  // never committed
  store_->CreateScene(abandoned, {}, {});
  CreateSingle();  // of scenes/test
  const auto unused = [&](int64_t before) {
    return store_->AgeUnusedScenes(before, INT64_MIN, kGrace);
  };
  EXPECT_TRUE(unused(wall_ + (int64_t{1} << 40)).empty()) << "the clock jumped: noted only";
  now_ += kGrace;
  EXPECT_TRUE(unused(wall_).empty()) << "the clock was set right: forgotten";
  now_ += kGrace;
  wall_ += 10;
  EXPECT_TRUE(unused(wall_).empty());
  now_ += kGrace;
  EXPECT_EQ(unused(wall_), std::vector<std::string>{abandoned.name});
}

TEST_P(QueueTest, DeletesUncommittedScenesEarlier) {
  constexpr int64_t kGrace = 1000;
  SceneRecord scene;
  for (const char* name : {"scenes/abandoned", "scenes/young"}) {
    scene.name = name;
    store_->CreateScene(scene, {}, {});
    wall_ += 10;
  }
  const auto unused = [&] { return store_->AgeUnusedScenes(INT64_MIN, wall_ - 10, kGrace); };
  EXPECT_TRUE(unused().empty()) << "noted only";
  now_ += kGrace;
  EXPECT_EQ(unused(), std::vector<std::string>{"scenes/abandoned"})
      << "not the one that is committed and has no job, nor the young one";
  store_->ActivateScene("scenes/abandoned", CaptureLayout::kPhotos, 1, {});
  EXPECT_TRUE(unused().empty());
}

TEST_P(QueueTest, NotificationsAreFairBetweenReceivers) {
  const auto end = [&](const std::string& url) {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.notify_url = url;
    graph.jobs = {Job("single")};
    store_->CreateGraph(graph, {}, kNoLimit);
    FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
    wall_ += 1;
  };
  for (int i = 0; i < 5; ++i) end("https://dead.example.org:8443/hook?" + std::to_string(i));
  end("http://b.example.org");
  end("https://good.example.org/hook");
  std::vector<std::string> urls;
  for (const Notification& due : store_->DueNotifications(2)) urls.push_back(due.url);
  EXPECT_EQ(urls,
            (std::vector<std::string>{"https://dead.example.org:8443/hook?0",
                                      "https://dead.example.org:8443/hook?1",
                                      "http://b.example.org",
                                      "https://good.example.org/hook"}));
}

TEST_P(QueueTest, NotificationStaysDueUntilDelivered) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.notify_url = "https://hooks.example.org";
  graph.jobs = {Job("first"), Job("root", {0})};
  const JobRecord root = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_TRUE(store_->DueNotifications(10).empty());
  FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
  Open();
  ASSERT_EQ(store_->DueNotifications(10).size(), 1u);
  const Notification due = store_->DueNotifications(10)[0];
  EXPECT_EQ(due.job, root.name);
  EXPECT_EQ(due.url, graph.notify_url);
  store_->DelayNotification(due.job_id, due.first_ms, 500);
  EXPECT_TRUE(store_->DueNotifications(10).empty());
  wall_ += 500;
  EXPECT_EQ(store_->DueNotifications(10)[0].tries, 1);
  store_->DelayNotification(due.job_id, due.first_ms, 500);
  wall_ -= int64_t{5} * 24 * 3600 * 1000;
  EXPECT_EQ(store_->DueNotifications(10).size(), 1u) << "a clock that is set back stalls nothing";
  wall_ += int64_t{5} * 24 * 3600 * 1000;
  store_->Retry(root.name, false, {}, kNoLimit);
  EXPECT_TRUE(store_->DueNotifications(10).empty()) << "it has not ended";
  Succeed(ClaimOne());
  Succeed(ClaimOne());
  store_->EndNotification(due.job_id, due.first_ms - 1);
  const std::vector<Notification> owed = store_->DueNotifications(10);
  ASSERT_EQ(owed.size(), 1u) << "word of another end is another word";
  store_->EndNotification(owed[0].job_id, owed[0].first_ms);
  EXPECT_TRUE(store_->DueNotifications(10).empty());
}

}  // namespace
}  // namespace color3d
