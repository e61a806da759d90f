#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {
class JobStateTest : public AnyStoreTest {};
COLOR3D_FOR_ALL_STORES(JobStateTest);
using ::testing::HasSubstr;

TEST_P(JobStateTest, GraphRunsInOrderOfEdges) {
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

TEST_P(JobStateTest, PlannedSkipsCountAsSatisfied) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("import"), Job("evaluate", {0}), Job("root", {0, 1})};
  graph.jobs[1].skip_reason = "no true colours were given";
  const JobRecord root = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(Child(root, "evaluate").state, JobState::kSkipped);
  Succeed(ClaimOne());
  EXPECT_EQ(ClaimOne().name, root.name);
}

TEST_P(JobStateTest, FailureSkipsDependantsAndFailsRoot) {
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

  // A separate job that reads the failed one is skipped, with the reason.
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

TEST_P(JobStateTest, CancelsQueuedAtOnceAndRunningAtHeartbeat) {
  const JobRecord root = CreateDiamond();
  const JobRecord import = ClaimOne();
  EXPECT_EQ(store_->Cancel(root.name, {}).state, JobState::kCancelled);
  EXPECT_EQ(Child(root, "left").state, JobState::kCancelled);
  EXPECT_EQ(Child(root, "import").state, JobState::kRunning);
  EXPECT_TRUE(store_->Heartbeat(LeaseOf(import), {}, {}, kLease).cancel_requested);
  EXPECT_EQ(ReasonThrown([&] { store_->Retry(root.name, false, {}, kNoLimit); }), "WRONG_STATE")
      << "import is still about to stop";
  FailWith(import, ErrorCode::kCancelled);
  EXPECT_EQ(Child(root, "import").state, JobState::kCancelled);
  EXPECT_EQ(store_->Cancel(root.name, {}).state, JobState::kCancelled) << "idempotent";
}

TEST_P(JobStateTest, CancelledChildEndsGraph) {
  const JobRecord root = CreateDiamond();
  store_->Cancel(Child(root, "left").name, {});
  EXPECT_EQ(StateOf(root.name), JobState::kCancelled);
  EXPECT_EQ(Child(root, "import").state, JobState::kQueued);
}

TEST_P(JobStateTest, RetryRequeuesFailedJobsAndKeepsPlannedSkips) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("import"),
                Job("left", {0}),
                Job("after", {1}),
                Job("no", {1}),
                Job("root", {0, 1, 2, 3})};
  graph.jobs[3].skip_reason = "planned";
  const JobRecord root = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(ReasonThrown([&] { store_->Retry(root.name, false, {}, kNoLimit); }), "WRONG_STATE");
  Succeed(ClaimOne());
  const JobRecord left = ClaimOne();
  store_->SetCheckpoint(LeaseOf(left), {Sha256Hex("c"), 1});
  FailWith(left, ErrorCode::kInternal);
  EXPECT_EQ(Child(root, "after").state, JobState::kSkipped);
  EXPECT_EQ(store_->Retry(root.name, false, {}, kNoLimit).state, JobState::kBlocked);
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

TEST_P(JobStateTest, RetryFromScratchDropsCheckpoint) {
  const JobRecord job = CreateSingle();
  const JobRecord running = ClaimOne();
  store_->SetCheckpoint(LeaseOf(running), {Sha256Hex("c"), 1});
  FailWith(running, ErrorCode::kInternal);
  store_->Retry(job.name, /*from_scratch=*/true, {}, kNoLimit);
  EXPECT_FALSE(ClaimOne().checkpoint.has_value());
}

TEST_P(JobStateTest, QueueLimitCountsWholeGraphs) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("a"), Job("b", {0})};
  store_->CreateGraph(graph, {}, 3);
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, 3); }), "QUEUE_FULL");
  EXPECT_EQ(store_->ListJobs({}, 0, 100, {}).size(), 2u) << "all of a graph or nothing";
}

TEST_P(JobStateTest, RefusesGraphOfInactiveScene) {
  SceneRecord scene;
  scene.name = "scenes/open";
  store_->CreateScene(scene, {}, {});
  NewGraph graph;
  graph.scene = "scenes/open";
  graph.jobs = {Job("a")};
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, kNoLimit); }), "SCENE_NOT_ACTIVE");
  graph.scene = "scenes/none";
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, kNoLimit); }), "SCENE_NOT_FOUND");
}

TEST_P(JobStateTest, JobsOfAGraphMayBelongToOtherScenes) {
  SceneRecord scene;
  scene.name = "scenes/other";
  store_->CreateScene(scene, {}, {});
  NewGraph graph = PersonalizeJobs(2);
  graph.jobs[1].scene = "scenes/other";
  EXPECT_EQ(ReasonThrown([&] { store_->CreateGraph(graph, {}, kNoLimit); }), "SCENE_NOT_ACTIVE");
  store_->ActivateScene("scenes/other", CaptureLayout::kPhotos, 1, {});
  const JobRecord root = store_->CreateGraph(graph, {}, kNoLimit);
  const auto children = store_->ListChildren(root.name);
  EXPECT_EQ(children[0].scene, "scenes/test");
  EXPECT_EQ(children[1].scene, "scenes/other");
}

TEST_P(JobStateTest, RetryRequiresInputs) {
  const JobRecord input = CreateSingle();
  Succeed(ClaimOne());
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("reader")};
  graph.jobs[0].input_jobs = {input.name};
  const JobRecord reader = store_->CreateGraph(graph, {}, kNoLimit);
  FailWith(ClaimOne(), ErrorCode::kInternal);
  store_->Delete(input.name, {});
  EXPECT_EQ(ReasonThrown([&] { store_->Retry(reader.name, false, {}, kNoLimit); }),
            "INPUT_DELETED");
  EXPECT_EQ(StateOf(reader.name), JobState::kFailed);
}

TEST_P(JobStateTest, RetryObeysQueueLimit) {
  const JobRecord root = CreateDiamond();
  FailWith(ClaimOne(), ErrorCode::kInternal);
  EXPECT_EQ(ReasonThrown([&] { store_->Retry(root.name, false, {}, 3); }), "QUEUE_FULL");
  EXPECT_EQ(StateOf(root.name), JobState::kFailed);
  store_->Retry(root.name, false, {}, 4);
  EXPECT_EQ(StateOf(root.name), JobState::kBlocked);
}

}  // namespace
}  // namespace color3d
