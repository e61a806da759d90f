// Isolation and quotas of projects.
#include "server/store/project_store.h"

#include <gtest/gtest.h>

#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {

class ProjectStoreTest : public AnyStoreTest {
 protected:
  ProjectStoreTest() {
    for (const ProjectStore& project : {a_, b_}) {
      SceneRecord scene;
      scene.name = "scenes/house";
      scene.files = {{"a.jpg", {Sha256Hex("photo"), 5}}};
      project.CreateScene(scene, {"CreateScene", "same id", "same body"}, {});
      project.ActivateScene("scenes/house", CaptureLayout::kPhotos, 1, {});
    }
  }
  static NewGraph Graph() {
    NewGraph graph;
    graph.scene = "scenes/house";
    graph.jobs = {Job("single")};
    return graph;
  }
  static JobRecord Create(const ProjectStore& project, const QueueLimits& limits = kNoLimit) {
    return project.CreateGraph(Graph(), {}, limits);
  }

  ProjectStore a_{*store_, "a"}, b_{*store_, "b"}, none_{*store_, ""};
};
COLOR3D_FOR_ALL_STORES(ProjectStoreTest);

TEST_P(ProjectStoreTest, ProjectsSeeOnlyTheirJobsAndScenes) {
  const JobRecord job = Create(a_);
  EXPECT_EQ(job.scene, "scenes/house");
  EXPECT_EQ(a_.GetJob(job.name).scene, "scenes/house");
  EXPECT_EQ(a_.ListJobs({"", "scenes/house", {}}, 0, 10, {}).size(), 1u);
  EXPECT_EQ(a_.ListScenes(0, 10).size(), 1u);
  EXPECT_EQ(a_.GetScene("scenes/house").name, "scenes/house");
  EXPECT_EQ(none_.ListScenes(0, 10).size(), 1u) << "that of the fixture";
  EXPECT_EQ(store_->ListScenes({}, 0, 10).size(), 3u);
  for (const ProjectStore& other : {b_, none_}) {
    EXPECT_TRUE(other.ListJobs({}, 0, 10, {}).empty());
    const std::vector<std::function<void()>> looks = {
        [&] { other.GetJob(job.name); },
        [&] { other.ListChildren(job.name); },
        [&] { other.GetInputs(job); },
        [&] { other.Cancel(job.name, {}); },
        [&] { other.Retry(job.name, false, {}, kNoLimit); },
        [&] { other.Delete(job.name, {}); },
        [&] { other.Pin(job.name, true); },
        [&] { other.ResolveWatch({job.name}); },
        [&] { other.AcceptKeyColor("scenes/house", job.name, {}); },
        [&] {
          NewGraph graph = Graph();
          graph.jobs[0].input_jobs = {job.name};
          other.CreateGraph(graph, {}, kNoLimit);
        }};
    for (const auto& look : looks) EXPECT_EQ(ReasonThrown(look), "JOB_NOT_FOUND");
  }
  EXPECT_EQ(ReasonThrown([&] { none_.GetScene("scenes/house"); }), "SCENE_NOT_FOUND");
  EXPECT_EQ(ReasonThrown([&] { none_.GetScene("scenes/house@a"); }), "SCENE_NOT_FOUND");
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
}

TEST_P(ProjectStoreTest, ScenesAndColorizersKeepPublicNames) {
  Create(a_);
  const JobRecord job = ClaimOne();
  EXPECT_EQ(store_->GetScene(job.scene).files.size(), 1u) << "as workers look for it";
  EXPECT_EQ(ReasonThrown([&] { a_.DeleteScene("scenes/house", {}); }), "SCENE_IN_USE");
  b_.DeleteScene("scenes/house", {});
  EXPECT_EQ(a_.GetScene("scenes/house").name, "scenes/house");
}

TEST_P(ProjectStoreTest, RequestIdsBelongToProject) {
  const RequestKey key{"CreateJob", "id", "body"};
  const JobRecord of_a = a_.CreateGraph(Graph(), key, kNoLimit);
  const JobRecord of_b = b_.CreateGraph(Graph(), {"CreateJob", "id", "another body"}, kNoLimit);
  EXPECT_NE(of_a.name, of_b.name);
  EXPECT_EQ(a_.CreateGraph(Graph(), key, kNoLimit).name, of_a.name);
  EXPECT_EQ(a_.FindRequest(key), of_a.name);
  EXPECT_FALSE(none_.FindRequest(key).has_value());
  a_.Cancel(of_a.name, {});
  const RequestKey away{"DeleteJob", "id", "body"};
  a_.Delete(of_a.name, away);
  EXPECT_NO_THROW(a_.Delete(of_a.name, away));
  EXPECT_EQ(ReasonThrown([&] { a_.Delete(of_a.name, {}); }), "JOB_NOT_FOUND");
}

TEST_P(ProjectStoreTest, BlobsAreReadableByTheirHolders) {
  const FileDigest photo{Sha256Hex("photo"), 5};
  EXPECT_FALSE(a_.HoldsBlob(photo)) << "to know its digest is not to have it";
  a_.HoldBlob(photo);
  a_.HoldBlob(photo);
  EXPECT_TRUE(a_.HoldsBlob(photo));
  EXPECT_FALSE(b_.HoldsBlob(photo));
  EXPECT_EQ(a_.Usage().stored_bytes, 5);
  const JobRecord job = Create(a_);
  Succeed(ClaimOne());
  const FileDigest result = a_.GetJob(job.name).artifacts[0].digest;
  EXPECT_TRUE(a_.HoldsBlob(result));
  EXPECT_FALSE(b_.HoldsBlob(result));
  EXPECT_EQ(a_.Usage().stored_bytes, 8);
  a_.Delete(job.name, {});
  EXPECT_FALSE(a_.HoldsBlob(result));
  EXPECT_TRUE(a_.HoldsBlob(photo)) << "the scene names it";
  store_->ForgetBlob(photo.sha256);
  EXPECT_TRUE(a_.HoldsBlob(photo)) << "somebody has stored and named it again";
  a_.DeleteScene("scenes/house", {});
  EXPECT_EQ(a_.Usage().stored_bytes, 0);
  const FileDigest unnamed{Sha256Hex("unnamed"), 7};
  b_.HoldBlob(unnamed);
  store_->ForgetBlob(unnamed.sha256);
  EXPECT_EQ(b_.Usage().stored_bytes, 0);
}

TEST_P(ProjectStoreTest, RowsCountTowardsQuota) {
  const int64_t before = a_.Usage().row_bytes;
  SceneRecord scene;
  scene.name = "scenes/long";
  for (int i = 0; i < 100; ++i) {
    scene.files.push_back({std::string(900, 'x') + std::to_string(i), {Sha256Hex("a"), 1}});
  }
  a_.CreateScene(scene, {}, {});
  EXPECT_GE(a_.Usage().row_bytes - before, 100 * 900);
  EXPECT_EQ(a_.Usage().scenes, 2);
  EXPECT_EQ(a_.Usage().uncommitted_scenes, 1);
  a_.ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
  a_.ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
  EXPECT_EQ(a_.Usage().uncommitted_scenes, 0);
  const int64_t of_others = b_.Usage().row_bytes, without_job = a_.Usage().row_bytes;
  NewGraph graph = Graph();
  graph.scene = scene.name;
  graph.jobs[0].spec = std::string(50'000, 's');
  const std::string job = a_.CreateGraph(graph, {}, kNoLimit).name;
  EXPECT_GE(a_.Usage().row_bytes - without_job, 50'000);
  const int64_t queued = a_.Usage().row_bytes;
  Publication publication;
  publication.artifacts = {{"result", {Sha256Hex("r"), 3}, "text/plain"}};
  store_->Publish(LeaseOf(ClaimOne()), publication);
  EXPECT_GT(a_.Usage().row_bytes, queued) << "an artifact has a row, its blob a block";
  a_.Delete(job, {});
  a_.DeleteScene(scene.name, {});
  EXPECT_EQ(a_.Usage().row_bytes, before);
  EXPECT_EQ(b_.Usage().row_bytes, of_others);
  a_.Cancel(Create(a_).name, {"CancelJob", "id", "body"});
  EXPECT_GT(a_.Usage().row_bytes, before + 2048 + 300 - 1) << "request ids have rows, too";
}

TEST_P(ProjectStoreTest, LimitsScenesAndUncommittedScenes) {
  const SceneLimits limits{4, 2};
  const auto create = [&](const ProjectStore& project, const std::string& name) {
    SceneRecord scene;
    scene.name = "scenes/" + name;
    return ReasonThrown([&] { project.CreateScene(scene, {}, limits); });
  };
  EXPECT_EQ(create(a_, "one"), "nothing");
  EXPECT_EQ(create(a_, "two"), "nothing");
  EXPECT_EQ(create(a_, "three"), "QUOTA_EXCEEDED") << "two are not committed";
  EXPECT_EQ(create(b_, "three"), "nothing") << "another project";
  a_.ActivateScene("scenes/one", CaptureLayout::kPhotos, 1, {});
  EXPECT_EQ(create(a_, "three"), "nothing");
  a_.ActivateScene("scenes/two", CaptureLayout::kPhotos, 1, {});
  EXPECT_EQ(create(a_, "four"), "QUOTA_EXCEEDED") << "four in all";
  a_.DeleteScene("scenes/one", {});
  EXPECT_EQ(create(a_, "four"), "nothing");
}

TEST_P(ProjectStoreTest, OneProjectCannotFillQueue) {
  const QueueLimits limits(5, 2);
  Create(a_, limits);
  Create(a_, limits);
  EXPECT_EQ(ReasonThrown([&] { Create(a_, limits); }), "QUOTA_EXCEEDED");
  for (int i = 0; i < 2; ++i) Create(b_, limits);
  EXPECT_EQ(a_.Usage().unfinished_jobs, 2);
  CreateSingle();
  EXPECT_EQ(ReasonThrown([&] { none_.CreateGraph(Graph(), {}, limits); }), "SCENE_NOT_FOUND");
  EXPECT_EQ(ReasonThrown([&] { Create(b_, QueueLimits(5, 9)); }), "QUEUE_FULL");
}

TEST_P(ProjectStoreTest, ProjectsTakeTurns) {
  for (int i = 0; i < 4; ++i) Create(a_);
  for (int i = 0; i < 2; ++i) Create(b_);
  std::string order;
  for (int i = 0; i < 6; ++i) order += ClaimOne().project;
  EXPECT_EQ(order, "ababaa");
  EXPECT_EQ(store_->ListProjects().size(), 3u) << "with the scene of none";
}

}  // namespace
}  // namespace color3d
