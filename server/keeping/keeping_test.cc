#include <gtest/gtest.h>

#include <fstream>

#include "server/keeping/backup.h"
#include "server/keeping/fsck.h"
#include "server/storage/data_folder.h"
#include "server/storage/file_blob_store.h"
#include "tests/support/service/job_store_fixture.h"
#include "tests/support/unprivileged.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

// Data folder with a scene, a job and its result.
class KeepingTest : public ::testing::Test {
 protected:
  KeepingTest() {
    PrepareDataFolder(paths_);
    SceneRecord scene;
    scene.name = "scenes/test";
    photo_ = blobs_.PutBytes("photo");
    scene.files = {{"a.jpg", photo_}};
    store_ = Open(paths_.root, StoreRole::kServer);
    store_->CreateScene(scene, {}, {});
    store_->ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
    job_ = Run("result");
    blobs_.PutBytes("named by nothing");
  }
  static std::unique_ptr<SqliteJobStore> Open(const fs::path& folder, StoreRole role) {
    return std::make_unique<SqliteJobStore>(DataPaths(folder).Store(), role, SystemClocks());
  }
  std::string Run(const std::string& result) {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.jobs.resize(1);
    graph.jobs[0].kind = "single";
    const std::string name = store_->CreateGraph(graph, {}, kNoLimit).name;
    const JobRecord job = store_->Claim("w", kLease).value();
    Publication publication;
    publication.artifacts = {{"result", blobs_.PutBytes(result), "text/plain"}};
    store_->Publish({job.id, job.lease_epoch}, publication);
    return name;
  }
  static std::string ResultIn(const fs::path& folder, const std::string& job) {
    const auto store = Open(folder, StoreRole::kServer);
    const JobRecord record = store->GetJob(job);
    return ReadFile(
        FileBlobStore(DataPaths(folder).Blobs()).Fetch(record.artifacts.at(0).digest.sha256));
  }
  void Damage(const FileDigest& digest) {
    const fs::path file = blobs_.Fetch(digest.sha256);
    fs::permissions(file, fs::perms::owner_all);
    std::ofstream(file, std::ios::binary) << std::string(digest.size_bytes, '!');
  }
  static FsckResult Check(const fs::path& folder, bool repair = false) {
    return Fsck(folder, "", nullptr, repair, [](int64_t) {});
  }

  ScratchFolder scratch_;
  DataPaths paths_{scratch_.path() / "data"};
  fs::path backup_ = scratch_.path() / "backup", fresh_ = scratch_.path() / "fresh";
  FileBlobStore blobs_{paths_.Blobs(), {0}};
  std::unique_ptr<SqliteJobStore> store_;
  FileDigest photo_;
  std::string job_;
};

TEST_F(KeepingTest, RestoredBackupIsServed) {
  const CopiedBlobs first = BackUp(paths_.root, backup_);  // the store is open: a server may run
  EXPECT_EQ(first.copied, 2) << "what nothing names stays behind";
  EXPECT_EQ(first.bytes, 5 + 6);
  const std::string later = Run("later");
  const CopiedBlobs second = BackUp(paths_.root, backup_);
  EXPECT_EQ(second.copied, 1);
  EXPECT_EQ(second.kept, 2);
  EXPECT_EQ(Restore(backup_, fresh_).copied, 3);
  EXPECT_EQ(ResultIn(fresh_, job_), "result");
  EXPECT_EQ(ResultIn(fresh_, later), "later");
  EXPECT_TRUE(Check(fresh_).IsGood());
  EXPECT_EQ(ReasonThrown([&] { Restore(backup_, fresh_); }), "FAILED_PRECONDITION") << "not empty";
  for (const fs::path& folder : {backup_, fresh_}) {
    EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
    for (const auto& entry : fs::directory_iterator(folder)) {
      EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
    }
  }
}

TEST_F(KeepingTest, BackupLeavesOutAndListsDamagedBlobs) {
  const std::vector<std::string> photo = {photo_.sha256};
  const fs::path other = scratch_.path() / "other";
  BackUp(paths_.root, backup_);
  const std::string later = Run("later");
  Damage(photo_);
  const CopiedBlobs partial = BackUp(paths_.root, other);
  EXPECT_EQ(partial.damaged, photo);
  EXPECT_EQ(partial.copied, 2);
  EXPECT_FALSE(fs::exists(other / ".blob.part"));
  EXPECT_TRUE(BackUp(paths_.root, backup_).IsWhole()) << "the earlier one has it whole";
  blobs_.Remove(photo_.sha256);
  EXPECT_EQ(BackUp(paths_.root, other).missing, photo);
  EXPECT_EQ(Restore(other, fresh_).missing, photo);
  EXPECT_EQ(ResultIn(fresh_, later), "later");
}

// The photos of an uncommitted scene were never uploaded: nothing is lost.
TEST_F(KeepingTest, AbandonedUploadsAreNoFault) {
  SceneRecord abandoned;
  abandoned.name = "scenes/abandoned";
  abandoned.files = {{"a.jpg", photo_}, {"b.jpg", {Sha256Hex("never sent"), 10}}};
  store_->CreateScene(abandoned, {}, {});
  const CopiedBlobs copied = BackUp(paths_.root, backup_);
  EXPECT_TRUE(copied.IsWhole());
  EXPECT_EQ(copied.awaited, 1);
  EXPECT_TRUE(Restore(backup_, fresh_).IsWhole());
  FsckResult result = Check(fresh_);
  EXPECT_TRUE(result.IsGood());
  EXPECT_EQ(result.awaited, 1);
  blobs_.Remove(photo_.sha256);
  const CopiedBlobs lacking = BackUp(paths_.root, scratch_.path() / "other");
  EXPECT_EQ(lacking.missing, std::vector<std::string>{photo_.sha256})
      << "a committed scene names it, too";
}

TEST_F(KeepingTest, SecondBackupReadsEarlierBlobsAgain) {
  BackUp(paths_.root, backup_);
  const fs::path copy = FileBlobStore(DataPaths(backup_).Blobs()).Fetch(photo_.sha256);
  fs::permissions(copy, fs::perms::owner_all);
  std::ofstream(copy, std::ios::binary) << "phot!";
  const CopiedBlobs second = BackUp(paths_.root, backup_);
  EXPECT_TRUE(second.IsWhole());
  EXPECT_EQ(second.mended, 1);
  EXPECT_EQ(second.copied, 1);
  EXPECT_EQ(second.kept, 1);
  EXPECT_EQ(ReadFile(copy), "photo");
  EXPECT_TRUE(Restore(backup_, fresh_).IsWhole());

  // If the original is missing, too, it is reported and the bad copy is removed.
  fs::permissions(copy, fs::perms::owner_all);
  std::ofstream(copy, std::ios::binary) << "phot!";
  blobs_.Remove(photo_.sha256);
  EXPECT_EQ(BackUp(paths_.root, backup_).missing, std::vector<std::string>{photo_.sha256});
  EXPECT_FALSE(fs::exists(copy));
}

class UnreadableKeepingTest : private testing::Unprivileged, public KeepingTest {};

TEST_F(UnreadableKeepingTest, UnreadableFilesAreReported) {
  const fs::path folder = blobs_.Fetch(photo_.sha256).parent_path();
  fs::permissions(folder, fs::perms::none);
  const CopiedBlobs copied = BackUp(paths_.root, backup_);
  EXPECT_FALSE(copied.IsWhole());
  EXPECT_TRUE(copied.missing.empty());
  EXPECT_EQ(copied.unreadable.size(), 1u);
  EXPECT_EQ(copied.copied, 1) << "all else is";
  store_.reset();
  FsckResult result = Check(paths_.root);
  EXPECT_FALSE(result.IsGood());
  EXPECT_TRUE(result.missing.empty());
  EXPECT_EQ(result.unreadable.size(), 2u) << "the folder, and the blob that is named";
  EXPECT_EQ(result.blobs, 2);
  fs::permissions(folder, fs::perms::owner_all);
  const fs::path file = blobs_.Fetch(photo_.sha256);
  fs::permissions(file, fs::perms::none);
  result = Check(paths_.root, /*repair=*/true);
  EXPECT_FALSE(result.IsGood());
  EXPECT_TRUE(result.missing.empty());
  EXPECT_EQ(result.unreadable.size(), 1u);
  EXPECT_TRUE(fs::exists(file)) << "nobody knows that it is damaged";
  fs::permissions(file, fs::perms::owner_read);
  EXPECT_TRUE(Check(paths_.root).IsGood());
}

// A worker replaces its checkpoint while the backup runs.
TEST_F(KeepingTest, JobWithoutItsCheckpointStartsOver) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs.resize(1);
  graph.jobs[0].kind = "single";
  store_->CreateGraph(graph, {}, kNoLimit);
  const JobRecord job = store_->Claim("w", kLease).value();
  store_->SetCheckpoint({job.id, job.lease_epoch}, {Sha256Hex("replaced"), 8});
  EXPECT_TRUE(BackUp(paths_.root, backup_).IsWhole());
  EXPECT_TRUE(store_->GetJob(job.name).checkpoint) << "it goes on where it is";
  EXPECT_TRUE(Restore(backup_, fresh_).IsWhole());
  EXPECT_FALSE(Open(fresh_, StoreRole::kServer)->GetJob(job.name).checkpoint);
  EXPECT_TRUE(Check(fresh_).IsGood());
}

TEST_F(KeepingTest, RefusesUnsuitableBackupFolders) {
  EXPECT_EQ(ReasonThrown([&] { BackUp(scratch_.path() / "none", backup_); }),
            "FAILED_PRECONDITION");
  const fs::path photos = scratch_.path() / "photos";
  fs::create_directory(photos);
  WriteFileAtomic(photos / "a.jpg", "x");
  EXPECT_EQ(ReasonThrown([&] { BackUp(paths_.root, photos); }), "FAILED_PRECONDITION");
  EXPECT_EQ(ReasonThrown([&] { BackUp(paths_.root, photos / "a.jpg" / "below"); }),
            "FAILED_PRECONDITION");
}

TEST_F(KeepingTest, FsckFindsAndRepairsFaults) {
  store_.reset();
  FsckResult result = Check(paths_.root);
  EXPECT_TRUE(result.IsGood());
  EXPECT_EQ(result.blobs, 3);
  EXPECT_EQ(result.unnamed, 1);
  Damage(photo_);
  result = Check(paths_.root, /*repair=*/true);
  EXPECT_EQ(result.damaged, std::vector<std::string>{photo_.sha256});
  EXPECT_TRUE(result.missing.empty());
  result = Check(paths_.root);
  EXPECT_EQ(result.missing, std::vector<std::string>{photo_.sha256});
  blobs_.PutBytes("photo");
  EXPECT_TRUE(Check(paths_.root).IsGood());
  const DataFolderLock server(paths_);
  EXPECT_EQ(ReasonThrown([&] { Check(paths_.root); }), "FAILED_PRECONDITION") << "a server runs";
}

TEST_F(KeepingTest, FsckReportsDamagedStore) {
  store_.reset();
  std::error_code error;
  fs::remove(paths_.Store().string() + "-wal", error);
  std::fstream file(paths_.Store(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(3 * 4096);
  file << std::string(4096, '!');
  file.close();
  try {
    const FsckResult result = Check(paths_.root);
    EXPECT_FALSE(result.IsGood());
  } catch (const Error& e) {
    EXPECT_EQ(ReasonOf(e), "STORE_CORRUPT");
  }
}

}  // namespace
}  // namespace color3d
