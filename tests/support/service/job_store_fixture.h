// Fixtures of the job store tests: a store, a clock set by the test, and one active scene.
// JobStoreTest is for SQLite alone, any_store_fixture.h for all stores.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "server/base/service_error.h"
#include "server/store/sqlite_job_store.h"

namespace color3d {

inline constexpr int64_t kLease = 1000;
inline constexpr int64_t kNoLimit = 1'000'000;

class JobStoreFixture {
 protected:
  virtual ~JobStoreFixture() = default;
  virtual std::unique_ptr<SqlJobStore> MakeStore(StoreRole role, const StoreOptions& options) = 0;

  // Must be called by the constructor.
  void Begin() {
    Open();
    SceneRecord scene;
    scene.name = "scenes/test";
    scene.files = {{"a.jpg", {Sha256Hex("a"), 1}}};
    store_->CreateScene(scene, {}, {});
    store_->ActivateScene("scenes/test", CaptureLayout::kPhotos, 1, {});
  }
  void Open() {
    StoreOptions options;
    options.retry_backoff_ms = 100;
    options.boot_id = boot_id_;
    store_ = MakeStore(StoreRole::kServer, options);
  }
  // Another store object on the same data, like that of another process.
  std::unique_ptr<SqlJobStore> OpenOther() { return MakeStore(StoreRole::kTool, {}); }
  std::filesystem::path File() const { return scratch_.path() / "jobs.db"; }
  Clocks TestClocks() {
    return {[this] { return wall_.load(); }, [this] { return now_.load(); }};
  }
  static NewJob Job(const std::string& kind, std::vector<int> inputs = {}) {
    NewJob job;
    job.kind = kind;
    job.spec = "spec of " + kind;
    job.inputs = std::move(inputs);
    return job;
  }
  // import -> {left, right} -> root
  JobRecord CreateDiamond(const RequestKey& request = {}) {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.jobs = {Job("import"), Job("left", {0}), Job("right", {0}), Job("root", {0, 1, 2})};
    return store_->CreateGraph(graph, request, kNoLimit);
  }
  // `count` personalize jobs under one parent.
  static NewGraph PersonalizeJobs(int count) {
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
  JobRecord CreateSingle() {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.jobs = {Job("single")};
    return store_->CreateGraph(graph, {}, kNoLimit);
  }
  // The store as workers see it.
  virtual WorkerStore& worker() { return *store_; }
  JobRecord ClaimOne(const std::string& name = "w") {
    std::optional<JobRecord> job = worker().Claim(name, kLease);
    EXPECT_TRUE(job.has_value());
    return job.value_or(JobRecord{});
  }
  static Lease LeaseOf(const JobRecord& job) { return {job.id, job.lease_epoch}; }
  void Succeed(const JobRecord& job, const std::string& artifact = "result") {
    Publication publication;
    publication.artifacts = {{artifact, {Sha256Hex(artifact + job.kind), 3}, "text/plain"}};
    worker().Publish(LeaseOf(job), publication);
  }
  void FailWith(const JobRecord& job, ErrorCode code) {
    worker().Fail(LeaseOf(job), {code, "TEST", "it broke"}, {});
  }
  JobState StateOf(const std::string& name) { return store_->GetJob(name).state; }
  JobRecord Child(const JobRecord& root, const std::string& kind) {
    for (const JobRecord& child : store_->ListChildren(root.name)) {
      if (child.kind == kind) return child;
    }
    ADD_FAILURE() << "no child job " << kind;
    return {};
  }

  ScratchFolder scratch_;
  std::atomic<int64_t> now_{1'000'000};   // of leases and pauses
  std::atomic<int64_t> wall_{1'000'000};  // of recorded times
  std::string boot_id_ = "boot 1";
  std::unique_ptr<SqlJobStore> store_;
};

class JobStoreTest : public ::testing::Test, protected JobStoreFixture {
 protected:
  JobStoreTest() { Begin(); }
  std::unique_ptr<SqlJobStore> MakeStore(StoreRole role, const StoreOptions& options) override {
    return std::make_unique<SqliteJobStore>(File(), role, TestClocks(), options);
  }
};

template <typename Body>
std::string ReasonThrown(const Body& body) {
  try {
    body();
  } catch (const Error& e) {
    return ReasonOf(e);
  }
  return "nothing";
}

}  // namespace color3d
