#include "server/store/postgresql/copy_store.h"

#include <gtest/gtest.h>

#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {
using testing::PostgresqlCluster;

// A SQLite store that is copied.
class CopyStoreTest : public JobStoreTest {
 protected:
  void SetUp() override {
    if (!PostgresqlCluster::IsInstalled()) {
      GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing; install postgresql-15";
    }
    address_ = PostgresqlCluster::Shared().NewDatabase(/*with_tables=*/false);
  }
  CopiedStore Copy(int64_t stop_after = INT64_MAX) {
    int64_t steps = 0;
    return CopyToPostgresql(File(), address_, [&](const std::string&, int64_t) {
      if (++steps > stop_after) throw InvalidArgument("interrupted");
    });
  }
  std::unique_ptr<PostgresqlJobStore> OpenCopy() {
    return std::make_unique<PostgresqlJobStore>(
        address_, StoreRole::kServer, TestClocks(), StoreOptions{});
  }

  std::string address_;
};

TEST_F(CopyStoreTest, CopyGoesOnAsTheOriginal) {
  const JobRecord root = CreateDiamond({"CreateJob", "id", "body"});
  Succeed(ClaimOne());
  const JobRecord running = ClaimOne();
  FailWith(ClaimOne(), ErrorCode::kUnavailable);  // waits before its next attempt
  store_->SetHold(Hold::kPaused, true);
  const int64_t newest = store_->NewestRevision();
  const CopiedStore copied = Copy();
  EXPECT_EQ(copied.rows.at("job"), 4);
  EXPECT_EQ(copied.rows.at("artifact"), 1);
  const auto copy = OpenCopy();
  EXPECT_EQ(copy->NewestRevision(), newest);
  EXPECT_EQ(copy->GetJob(root.name).spec, store_->GetJob(root.name).spec);
  EXPECT_EQ(copy->FindRequest({"CreateJob", "id", "body"}), root.name);
  EXPECT_EQ(copy->GetProject("").row_bytes, store_->GetProject("").row_bytes);
  EXPECT_EQ(copy->GetProject("").stored_bytes, store_->GetProject("").stored_bytes);
  EXPECT_FALSE(copy->Claim("w", kLease)) << "still paused";
  copy->SetHold(Hold::kPaused, false);
  EXPECT_EQ(copy->ReapExpired(), 1) << "its worker is not of this store";
  now_ += 60'000;
  for (int i = 0; i < 3; ++i) {
    const auto job = copy->Claim("w", kLease);
    ASSERT_TRUE(job);
    Publication publication;
    copy->Publish(LeaseOf(*job), publication);
  }
  EXPECT_EQ(copy->GetJob(root.name).state, JobState::kSucceeded);
  EXPECT_GT(copy->GetJob(root.name).revision, newest);
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("single")};
  EXPECT_GT(copy->CreateGraph(graph, {}, kNoLimit).id, root.id) << "ids go on";
  EXPECT_EQ(StateOf(running.name), JobState::kRunning) << "the original is unchanged";
}

TEST_F(CopyStoreTest, InterruptedCopyIsRefusedAndRepeated) {
  CreateDiamond();
  EXPECT_EQ(ReasonThrown([&] { Copy(/*stop_after=*/3); }), "INVALID_ARGUMENT");
  EXPECT_EQ(ReasonThrown([&] { OpenCopy(); }), "STORE_NOT_READY");
  CreateSingle();
  EXPECT_EQ(Copy().rows.at("job"), 5);
  EXPECT_EQ(Copy().rows.at("job"), 5) << "no server has used it";
  EXPECT_EQ(OpenCopy()->CountJobs().queued, 5);
  EXPECT_EQ(ReasonThrown([&] { Copy(); }), "FAILED_PRECONDITION") << "a server has";
}

}  // namespace
}  // namespace color3d
