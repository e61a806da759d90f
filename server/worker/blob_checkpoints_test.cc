// Checkpoints of several attempts, possibly with equal bytes.
#include "server/worker/blob_checkpoints.h"

#include <gtest/gtest.h>

#include "server/storage/file_blob_store.h"
#include "tests/support/service/job_store_fixture.h"

namespace color3d {
namespace {

class BlobCheckpointsTest : public JobStoreTest {
 protected:
  JobRecord Running() {
    CreateSingle();
    return ClaimOne();
  }
  BlobCheckpoints Of(const JobRecord& job) {
    return BlobCheckpoints(*store_, blobs_, job, std::chrono::milliseconds(0));
  }
  bool IsThere(const std::string& state) { return blobs_.Look(Sha256Hex(state)).has_value(); }

  FileBlobStore blobs_{scratch_.path() / "blobs", {0}};
};

TEST_F(BlobCheckpointsTest, KeepsOnlyNewestCheckpoint) {
  auto checkpoints = Of(Running());
  checkpoints.Save("one");
  checkpoints.Save("two");
  checkpoints.Save("two");
  EXPECT_FALSE(IsThere("one"));
  EXPECT_EQ(checkpoints.Load(), "two");
  const auto file = scratch_.path() / "state";
  WriteFileAtomic(file, "three");
  checkpoints.SaveFile(file);
  EXPECT_FALSE(IsThere("two"));
  checkpoints.RemoveNewest();
  EXPECT_TRUE(IsThere("three")) << "the job's row names it still";
}

// Another worker has stored the same bytes and will name them.
TEST_F(BlobCheckpointsTest, KeepsBlobThatOtherJobTouched) {
  auto checkpoints = Of(Running());
  checkpoints.Save("equal");
  const FileDigest other = blobs_.PutBytes("equal");  // found there, and touched
  checkpoints.Save("next");
  EXPECT_TRUE(IsThere("equal"));
  const JobRecord another = Running();
  store_->SetCheckpoint(LeaseOf(another), other);
  EXPECT_EQ(Of(store_->GetJob(another.name)).Load(), "equal");
}

TEST_F(BlobCheckpointsTest, KeepsBlobStoredByOtherJob) {
  blobs_.PutBytes("equal");
  auto checkpoints = Of(Running());
  checkpoints.Save("equal");
  checkpoints.Save("next");
  EXPECT_TRUE(IsThere("equal")) << "who stored it may name it at any time; the sweep decides";
}

}  // namespace
}  // namespace color3d
