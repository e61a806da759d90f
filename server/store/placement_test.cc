// Which worker gets which job: shares of projects, deadlines, memory, preferred workers.
#include <gtest/gtest.h>

#include <map>

#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {
class PlacementTest : public AnyStoreTest {
 protected:
  JobRecord Create(const std::string& project,
                   int64_t deadline_ms = kNoDeadline,
                   int64_t memory_bytes = 0) {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.project = project;
    graph.deadline_ms = deadline_ms;
    graph.jobs = {Job("single")};
    graph.jobs[0].needs.memory_bytes = memory_bytes;
    return store_->CreateGraph(graph, {}, kNoLimit);
  }
  void Report(const std::string& worker,
              const std::string& job,
              int64_t memory_bytes,
              int64_t cache_bytes) {
    WorkerRecord record;
    record.worker_id = worker;
    record.job = job;
    record.memory_limit_bytes = memory_bytes;
    record.cache_limit_bytes = cache_bytes;
    store_->UpdateWorker(record);
  }
  // Claims as a worker with this memory; returns the name of the job, or "".
  std::string ClaimWith(const std::string& worker, int64_t memory_bytes) {
    ClaimTerms terms{.worker = worker, .lease_ms = kLease};
    terms.memory_limit_bytes = memory_bytes;
    const auto job = store_->Claim(terms);
    return job ? job->name : "";
  }
};
COLOR3D_FOR_ALL_STORES(PlacementTest);

TEST_P(PlacementTest, ProjectsGetSharesByWeight) {
  for (const char* project : {"a", "b", "c"}) {
    for (int i = 0; i < 20; ++i) Create(project);
  }
  EXPECT_EQ(store_->SetProjectWeight("b", 3).weight, 3);
  EXPECT_EQ(store_->GetProject("b").weight, 3);
  EXPECT_EQ(store_->GetProject("a").weight, 1);
  std::map<std::string, int> claims;
  for (int i = 0; i < 20; ++i) ++claims[ClaimOne().project];
  EXPECT_EQ(claims, (std::map<std::string, int>{{"a", 4}, {"b", 12}, {"c", 4}}));
}

TEST_P(PlacementTest, IdleProjectSavesOneTurnAtMost) {
  for (int i = 0; i < 30; ++i) Create("busy");
  for (int i = 0; i < 20; ++i) ClaimOne();
  for (int i = 0; i < 10; ++i) Create("idle");
  std::string order;
  for (int i = 0; i < 8; ++i) order += ClaimOne().project[0];
  EXPECT_EQ(order.substr(0, 1), "i");
  EXPECT_EQ(std::count(order.begin(), order.end(), 'b'), 4) << order;
}

TEST_P(PlacementTest, EarliestDeadlineOfProjectStartsFirst) {
  const JobRecord none = Create("");
  const JobRecord late = Create("", wall_ + 9000);
  const JobRecord early = Create("", wall_ + 1000);
  EXPECT_EQ(store_->GetJob(early.name).deadline_ms, wall_ + 1000);
  EXPECT_EQ(ClaimOne().name, early.name);
  EXPECT_EQ(ClaimOne().name, late.name);
  EXPECT_EQ(ClaimOne().name, none.name);
}

TEST_P(PlacementTest, JobsAreLeftToWorkersWithEnoughMemory) {
  Report("small", "", 1000, 0);
  Report("big", "", 4000, 0);
  const JobRecord large = Create("", kNoDeadline, 3000), fits = Create("", kNoDeadline, 900);
  EXPECT_EQ(ClaimWith("small", 1000), fits.name);
  EXPECT_EQ(ClaimWith("small", 1000), "");
  Report("big", "jobs/other", 4000, 0);
  EXPECT_NE(store_->PlaceInQueue(large).waits_for.find("memory"), std::string::npos);
  EXPECT_EQ(ClaimWith("big", 4000), large.name);
}

TEST_P(PlacementTest, WorkerWithMostMemoryTakesAllJobs) {
  Report("small", "", 1000, 0);
  Report("big", "", 4000, 0);
  const JobRecord huge = Create("", kNoDeadline, 9000);
  EXPECT_EQ(ClaimWith("small", 1000), "");
  wall_ += 3'600'000;  // "big" is not heard of
  Report("small", "", 1000, 0);
  EXPECT_EQ(ClaimWith("small", 1000), huge.name) << "an estimate must not stall a job for ever";
}

TEST_P(PlacementTest, NextStagePrefersWorkerThatHasItsFiles) {
  Report("w@far", "", 0, 1000);
  Report("v@far", "", 0, 1000);
  CreateDiamond();
  const JobRecord import = ClaimOne("w@far");
  Report("w@far", import.name, 0, 1000);
  Succeed(import);
  EXPECT_EQ(ClaimOne("v@far").kind, "right") << "a worker runs one of them: the other is free";
  EXPECT_FALSE(store_->Claim("v@far", kLease));
  EXPECT_EQ(ClaimOne("w@far").kind, "left");
}

TEST_P(PlacementTest, PreferenceEndsAfterSeconds) {
  Report("w@far", "", 0, 1000);
  CreateDiamond();
  const JobRecord import = ClaimOne("w@far");
  Succeed(import);
  ClaimOne("v@far");
  EXPECT_FALSE(store_->Claim("v@far", kLease));
  now_ += 3000;
  EXPECT_EQ(ClaimOne("v@far").kind, "left");
}

TEST_P(PlacementTest, SceneGoesToWorkerOfItsLastJob) {
  Report("w@far", "", 0, 1000);
  Report("v@far", "", 0, 1000);
  Create("");
  Succeed(ClaimOne("w@far"));
  const JobRecord next = Create("");
  EXPECT_FALSE(store_->Claim("v@far", kLease));
  EXPECT_EQ(ClaimOne("w@far").name, next.name);
  Report("w@far", next.name, 0, 1000);
  Create("");
  EXPECT_TRUE(store_->Claim("v@far", kLease)) << "its worker is busy";
}

TEST_P(PlacementTest, WorkersWithoutCacheArePreferredByNoJob) {
  Report("w", "", 0, 0);
  CreateDiamond();
  Succeed(ClaimOne("w"));
  EXPECT_EQ(ClaimOne("v").kind, "left");
}

TEST_P(PlacementTest, QueueIsListedInOrderOfTurns) {
  const JobRecord running = Create("z");
  ClaimOne("worker");
  std::vector<std::string> names;
  for (int i = 0; i < 3; ++i) names.push_back(Create("a").name);
  const JobRecord other = Create("b");
  const JobRecord urgent = [&] {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.project = "b";
    graph.priority = 5;
    graph.jobs = {Job("single")};
    return store_->CreateGraph(graph, {}, kNoLimit);
  }();
  std::vector<std::string> listed;
  for (const JobRecord& job : store_->ListQueue(100)) listed.push_back(job.name);
  EXPECT_EQ(listed,
            (std::vector<std::string>{
                running.name, urgent.name, names[0], other.name, names[1], names[2]}));
  EXPECT_EQ(store_->ListQueue(2).size(), 3u);
  EXPECT_EQ(store_->ListQueue(100)[0].worker, "worker");
}

TEST_P(PlacementTest, WorkersTellAboutThemselves) {
  WorkerRecord worker{"w@far", 0, "", 5, 0};
  worker.machine = "node7";
  worker.release = "1.2.3";
  worker.threads = 8;
  worker.memory_limit_bytes = 6;
  worker.simd = "avx2";
  worker.cache_bytes = 7;
  worker.cache_limit_bytes = 70;
  worker.cache_hit_bytes = 8;
  worker.cache_miss_bytes = 9;
  worker.finished_jobs = 10;
  store_->UpdateWorker(worker);
  worker.finished_jobs = 11;
  store_->UpdateWorker(worker);
  const std::vector<WorkerRecord> told = store_->ListWorkers();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].machine, "node7");
  EXPECT_EQ(told[0].release, "1.2.3");
  EXPECT_EQ(told[0].threads, 8);
  EXPECT_EQ(told[0].memory_bytes, 5);
  EXPECT_EQ(told[0].memory_limit_bytes, 6);
  EXPECT_EQ(told[0].simd, "avx2");
  EXPECT_EQ(told[0].cache_bytes, 7);
  EXPECT_EQ(told[0].cache_limit_bytes, 70);
  EXPECT_EQ(told[0].cache_hit_bytes, 8);
  EXPECT_EQ(told[0].cache_miss_bytes, 9);
  EXPECT_EQ(told[0].finished_jobs, 11);
  EXPECT_EQ(told[0].heartbeat_ms, wall_);
}

}  // namespace
}  // namespace color3d
