#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/job_store_fixture.h"

namespace color3d {
namespace {
using JobStateTest = JobStoreTest;
using ::testing::HasSubstr;

TEST_F(JobStateTest, GraphRunsInOrderOfItsEdges) {
  const JobRecord root = CreateDiamond();
  EXPECT_EQ(root.state, JobState::kBlocked);
  EXPECT_EQ(root.kind, "root");
  const JobRecord import = ClaimOne();
  EXPECT_EQ(import.kind, "import");
  EXPECT_EQ(import.parent, root.name);
  EXPECT_EQ(import.spec, "spec of import");
  EXPECT_FALSE(store_->Claim("w", kLease)) << "the others wait for import";
  Succeed(import);
  const JobRecord left = ClaimOne();
  const JobRecord right = ClaimOne();
  EXPECT_EQ(left.kind, "left");
  EXPECT_EQ(right.kind, "right");
  const auto inputs = store_->GetInputs(left.id);
  ASSERT_EQ(inputs.size(), 1u);
  EXPECT_EQ(inputs[0].artifacts.at(0).name, "result");
  Succeed(left);
  EXPECT_FALSE(store_->Claim("w", kLease)) << "the root waits for right";
  Succeed(right);
  const JobRecord last = ClaimOne();
  EXPECT_EQ(last.name, root.name);
  EXPECT_EQ(store_->GetInputs(last.id).size(), 3u);
  Succeed(last);
  EXPECT_EQ(StateOf(root.name), JobState::kSucceeded);
  EXPECT_TRUE(store_->AllFinished(store_->ResolveWatch({root.name})));
}

TEST_F(JobStateTest, PlannedSkipsCountAsSatisfied) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("import"), Job("evaluate", {0}), Job("root", {0, 1})};
  graph.jobs[1].skip_reason = "no true colours were given";
  const JobRecord root = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(Child(root, "evaluate").state, JobState::kSkipped);
  Succeed(ClaimOne());
  EXPECT_EQ(ClaimOne().name, root.name);
}

TEST_F(JobStateTest, FailureSkipsDependantsAndFailsTheSubmittedJob) {
  const JobRecord root = CreateDiamond();
  Succeed(ClaimOne());
  const JobRecord left = ClaimOne();
  FailWith(left, ErrorCode::kInvalidArgument);
  const JobRecord failed = store_->GetJob(root.name);
  EXPECT_EQ(failed.state, JobState::kFailed);
  ASSERT_TRUE(failed.error.has_value());
  EXPECT_EQ(failed.error->code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(failed.error->message, HasSubstr(left.name));
  EXPECT_THAT(failed.error->message, HasSubstr("it broke"));
  EXPECT_EQ(Child(root, "right").state, JobState::kQueued) << "independent work goes on";

  // A job of its own that reads the failed one is skipped, with the reason.
  const JobRecord second = CreateDiamond();
  NewGraph reader;
  reader.scene = "scenes/test";
  reader.jobs = {Job("reader")};
  reader.jobs[0].input_jobs = {Child(second, "left").name};
  const JobRecord own = store_->CreateGraph(reader, {}, kNoLimit);
  Succeed(ClaimOne());  // right of the first graph
  Succeed(ClaimOne());  // import of the second
  FailWith(ClaimOne(), ErrorCode::kInternal);
  EXPECT_EQ(StateOf(own.name), JobState::kSkipped);
  EXPECT_THAT(store_->GetJob(own.name).skip_reason, HasSubstr("failed: it broke"));
}

TEST_F(JobStateTest, ZombieCanPublishNothing) {
  const JobRecord job = CreateSingle();
  const JobRecord zombie = ClaimOne("first");
  now_ += kLease + 1;
  EXPECT_EQ(store_->ReapExpired(), 1);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  now_ += 1000;
  const JobRecord second = ClaimOne("second");
  EXPECT_EQ(second.lease_epoch, zombie.lease_epoch + 1);
  EXPECT_EQ(second.attempt, 2);
  const Lease old = LeaseOf(zombie);
  EXPECT_EQ(ReasonThrown([&] { Succeed(zombie, "stale"); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { store_->Heartbeat(old, {}, {}, kLease); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { store_->Peek(old); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { store_->SetCheckpoint(old, {Sha256Hex("x"), 1}); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { FailWith(zombie, ErrorCode::kInternal); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { store_->Release(old, {}); }), "LEASE_LOST");
  EXPECT_TRUE(store_->GetJob(job.name).artifacts.empty());
  Succeed(second, "fresh");
  EXPECT_EQ(store_->GetJob(job.name).artifacts.at(0).name, "fresh");
  EXPECT_EQ(ReasonThrown([&] { Succeed(second, "again"); }), "LEASE_LOST") << "only once";
}

TEST_F(JobStateTest, HeartbeatKeepsTheLease) {
  CreateSingle();
  const JobRecord job = ClaimOne();
  for (int i = 0; i < 5; ++i) {
    now_ += kLease - 100;
    ProgressRecord progress;
    progress.step = i;
    store_->Heartbeat(LeaseOf(job), progress, {.warnings = {"warned"}}, kLease);
    EXPECT_EQ(store_->ReapExpired(), 0);
  }
  const JobRecord running = store_->GetJob(job.name);
  EXPECT_EQ(running.progress.step, 4);
  EXPECT_EQ(running.usage.warnings, std::vector<std::string>{"warned"});
}

TEST_F(JobStateTest, PoisonJobStopsAfterItsAttempts) {
  const JobRecord job = CreateSingle();
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(ClaimOne().attempt, attempt);
    now_ += kLease + 1;
    store_->ReapExpired();
    EXPECT_FALSE(attempt < 3 && store_->Claim("w", kLease)) << "back-off";
    now_ += 10'000;
  }
  const JobRecord failed = store_->GetJob(job.name);
  EXPECT_EQ(failed.state, JobState::kFailed);
  EXPECT_EQ(failed.error->reason, "WORKER_LOST");
  EXPECT_FALSE(store_->Claim("w", kLease));
}

TEST_F(JobStateTest, OnlyPassingFaultsAreTriedAgain) {
  const JobRecord job = CreateSingle();
  FailWith(ClaimOne(), ErrorCode::kUnavailable);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  now_ += 10'000;
  FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(StateOf(job.name), JobState::kFailed);
}

TEST_F(JobStateTest, DrainDoesNotCountTheAttempt) {
  const JobRecord job = CreateSingle();
  for (int i = 0; i < 5; ++i) store_->Release(LeaseOf(ClaimOne()), {});
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  EXPECT_EQ(ClaimOne().attempt, 1);
}

TEST_F(JobStateTest, CheckpointSurvivesTheAttempt) {
  CreateSingle();
  const JobRecord first = ClaimOne();
  EXPECT_FALSE(store_->SetCheckpoint(LeaseOf(first), {Sha256Hex("1"), 10}));
  const auto replaced = store_->SetCheckpoint(LeaseOf(first), {Sha256Hex("2"), 20});
  EXPECT_EQ(replaced.value().sha256, Sha256Hex("1"));
  EXPECT_TRUE(store_->IsReferenced(Sha256Hex("2")));
  EXPECT_FALSE(store_->IsReferenced(Sha256Hex("1")));
  store_->Release(LeaseOf(first), {});
  const JobRecord second = ClaimOne();
  EXPECT_EQ(second.checkpoint.value().sha256, Sha256Hex("2"));
  Succeed(second);
  EXPECT_FALSE(store_->IsReferenced(Sha256Hex("2"))) << "of no more use";
}

TEST_F(JobStateTest, CancelQueuedAtOnceAndRunningAtItsNextHeartbeat) {
  const JobRecord root = CreateDiamond();
  const JobRecord import = ClaimOne();
  EXPECT_EQ(store_->Cancel(root.name, {}).state, JobState::kCancelled);
  EXPECT_EQ(Child(root, "left").state, JobState::kCancelled);
  EXPECT_EQ(Child(root, "import").state, JobState::kRunning);
  EXPECT_TRUE(store_->Heartbeat(LeaseOf(import), {}, {}, kLease).cancel_requested);
  EXPECT_EQ(ReasonThrown([&] { store_->Retry(root.name, false, {}); }), "WRONG_STATE")
      << "import is still about to stop";
  FailWith(import, ErrorCode::kCancelled);
  EXPECT_EQ(Child(root, "import").state, JobState::kCancelled);
  EXPECT_EQ(store_->Cancel(root.name, {}).state, JobState::kCancelled) << "idempotent";
}

TEST_F(JobStateTest, CrashAfterCancelDoesNotResurrect) {
  const JobRecord job = CreateSingle();
  ClaimOne();
  store_->Cancel(job.name, {});
  now_ += kLease + 1;
  store_->ReapExpired();
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

TEST_F(JobStateTest, DrainOfACancelledJobEndsIt) {
  const JobRecord job = CreateSingle();
  const JobRecord running = ClaimOne();
  store_->Cancel(job.name, {});
  store_->Release(LeaseOf(running), {});
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

TEST_F(JobStateTest, CancellingAChildEndsItsGraph) {
  const JobRecord root = CreateDiamond();
  store_->Cancel(Child(root, "left").name, {});
  EXPECT_EQ(StateOf(root.name), JobState::kCancelled);
  EXPECT_EQ(Child(root, "import").state, JobState::kQueued);
}

TEST_F(JobStateTest, RetryBringsBackWhatFailedAndKeepsPlannedSkips) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("import"),
                Job("left", {0}),
                Job("after", {1}),
                Job("no", {1}),
                Job("root", {0, 1, 2, 3})};
  graph.jobs[3].skip_reason = "planned";
  const JobRecord root = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(ReasonThrown([&] { store_->Retry(root.name, false, {}); }), "WRONG_STATE");
  Succeed(ClaimOne());
  const JobRecord left = ClaimOne();
  store_->SetCheckpoint(LeaseOf(left), {Sha256Hex("c"), 1});
  FailWith(left, ErrorCode::kInternal);
  EXPECT_EQ(Child(root, "after").state, JobState::kSkipped);
  EXPECT_EQ(store_->Retry(root.name, false, {}).state, JobState::kBlocked);
  EXPECT_EQ(Child(root, "after").state, JobState::kBlocked);
  EXPECT_EQ(Child(root, "no").state, JobState::kSkipped);
  EXPECT_EQ(Child(root, "import").state, JobState::kSucceeded);
  const JobRecord again = ClaimOne();
  EXPECT_EQ(again.kind, "left");
  EXPECT_EQ(again.attempt, 1);
  EXPECT_TRUE(again.checkpoint.has_value());
  EXPECT_FALSE(again.error.has_value());
  Succeed(again);
  Succeed(ClaimOne());
  Succeed(ClaimOne());
  EXPECT_EQ(StateOf(root.name), JobState::kSucceeded);
}

TEST_F(JobStateTest, RetryFromScratchForgetsTheCheckpoint) {
  const JobRecord job = CreateSingle();
  const JobRecord running = ClaimOne();
  store_->SetCheckpoint(LeaseOf(running), {Sha256Hex("c"), 1});
  FailWith(running, ErrorCode::kInternal);
  store_->Retry(job.name, /*from_scratch=*/true, {});
  EXPECT_FALSE(ClaimOne().checkpoint.has_value());
}

TEST_F(JobStateTest, QueueLimitCountsWholeGraphs) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("a"), Job("b", {0})};
  store_->CreateGraph(graph, {}, 3);
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, 3); }), "QUEUE_FULL");
  EXPECT_EQ(store_->ListJobs({}, 0, 100).size(), 2u) << "all of a graph or nothing";
}

TEST_F(JobStateTest, GraphOfAnInactiveSceneIsRefused) {
  SceneRecord scene;
  scene.name = "scenes/open";
  store_->CreateScene(scene, {});
  NewGraph graph;
  graph.scene = "scenes/open";
  graph.jobs = {Job("a")};
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, kNoLimit); }), "SCENE_NOT_ACTIVE");
  graph.scene = "scenes/none";
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, kNoLimit); }), "SCENE_NOT_FOUND");
}

TEST_F(JobStateTest, PriorityThenAge) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("a")};
  const JobRecord first = store_->CreateGraph(graph, {}, kNoLimit);
  graph.priority = 5;
  const JobRecord urgent = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(ClaimOne().name, urgent.name);
  EXPECT_EQ(ClaimOne().name, first.name);
}

NewGraph PersonalizeJobs(int count) {
  NewGraph graph;
  graph.scene = "scenes/test";
  for (int i = 0; i < count; ++i) {
    NewJob job;
    job.kind = "personalize";
    job.spec = "a";
    graph.jobs.push_back(job);
  }
  NewJob root;
  root.kind = "root";
  for (int i = 0; i < count; ++i) root.inputs.push_back(i);
  graph.jobs.push_back(root);
  return graph;
}

const auto kAnyJob = [](const JobRecord&) { return true; };

TEST_F(JobStateTest, JobsOfABatchTakeTurnsBetweenSubmittedJobs) {
  const JobRecord many = store_->CreateGraph(PersonalizeJobs(5), {}, kNoLimit);
  const JobRecord few = store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  EXPECT_EQ(ClaimOne().parent, many.name);
  const auto next = [&] { return store_->ClaimForBatch("w", kLease, "personalize", kAnyJob); };
  EXPECT_EQ(next()->parent, few.name) << "it has none running yet";
  const auto third = next();
  EXPECT_EQ(third->parent, many.name);
  EXPECT_EQ(third->state, JobState::kRunning);
  EXPECT_EQ(third->attempt, 1);
  EXPECT_FALSE(
      store_->ClaimForBatch("w", kLease, "personalize", [](const JobRecord&) { return false; }));
}

TEST_F(JobStateTest, JobsOfABatchDoNotOvertakeOtherKinds) {
  store_->CreateGraph(PersonalizeJobs(2), {}, kNoLimit);
  ClaimOne();
  const JobRecord other = CreateSingle();
  EXPECT_TRUE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob)) << "it came before";
  store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  EXPECT_FALSE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob));
  EXPECT_EQ(ClaimOne().name, other.name);
  EXPECT_TRUE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob));
}

TEST_F(JobStateTest, AJobThatAWorkerWasLostWithGetsNoCompany) {
  store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  ClaimOne();
  now_ += kLease + 1;
  EXPECT_EQ(store_->ReapExpired(), 1);
  now_ += 1'000'000;
  EXPECT_FALSE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob));
  EXPECT_EQ(ClaimOne().attempt, 2);
}

TEST_F(JobStateTest, JobsOfAGraphMayBelongToOtherScenes) {
  SceneRecord scene;
  scene.name = "scenes/other";
  store_->CreateScene(scene, {});
  NewGraph graph = PersonalizeJobs(2);
  graph.jobs[1].scene = "scenes/other";
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, kNoLimit); }), "SCENE_NOT_ACTIVE");
  store_->ActivateScene("scenes/other", StoredLayout::kPhotos, 1, {});
  const JobRecord root = store_->CreateGraph(graph, {}, kNoLimit);
  const auto children = store_->ListChildren(root.name);
  EXPECT_EQ(children[0].scene, "scenes/test");
  EXPECT_EQ(children[1].scene, "scenes/other");
}

}  // namespace
}  // namespace color3d
