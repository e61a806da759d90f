#include "server/rpc/jobs/watch_batches.h"

#include <gtest/gtest.h>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {

class WatchBatchesTest : public RpcTest {
 protected:
  std::shared_ptr<const WatchBatch> After(int64_t revision, const std::string& project = "") {
    return batches_.After(revision, ids_, ProjectStore(store_, project));
  }

  WatchBatches batches_{store_};
  const std::string name_ =
      client_->Create(ScriptedSpec(client_->MakeScene().name(), "steps=1")).name();
  const std::vector<int64_t> ids_ = ProjectStore(store_, "").ResolveWatch({name_});
};

TEST_F(WatchBatchesTest, WhoHasSeenAsMuchGetsTheSame) {
  const auto first = After(0);
  EXPECT_FALSE(first->events.empty());
  EXPECT_FALSE(first->all_finished);
  EXPECT_EQ(After(0), first);
  EXPECT_NE(After(0, "another"), first) << "projects share nothing";
  const auto later = After(first->events.back().revision);
  EXPECT_TRUE(later->events.empty());
  EXPECT_EQ(Work(), 2);
  EXPECT_EQ(After(0), first) << "until it is said that something happened";
  batches_.Forget();
  const auto now = After(0);
  EXPECT_GT(now->events.size(), first->events.size());
  EXPECT_TRUE(now->all_finished);
}

}  // namespace
}  // namespace color3d::testing
