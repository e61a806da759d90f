// Blobs of a server over connections that break, and over damage.
#include "server/worker/remote/remote_blobs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/base/random.h"
#include "server/base/service_error.h"
#include "server/worker/remote/remote_store.h"
#include "tests/support/service/byte_limit_proxy.h"
#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int64_t kCut = 1'500'000;
constexpr size_t kBlobBytes = 6 << 20;  // several cuts long

std::string RandomBytes(size_t size, uint64_t seed) {
  Random random(seed);
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random.NextBelow(256));
  return bytes;
}

std::string ReasonOfThrown(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    return ReasonOf(e);
  }
  return "nothing";
}

class RemoteBlobsTest : public RpcTest {
 protected:
  RemoteBlobsTest() : RpcTest(16 << 20) {}

  std::string Read(const RemoteBlobs& blobs, const std::string& sha256) {
    std::string bytes;
    blobs.Borrow(sha256, [&](const fs::path& file) { bytes = ReadFile(file); });
    return bytes;
  }

  const LinkTiming timing_{std::chrono::seconds(10), std::chrono::seconds(20)};
  BlobCache cache_{scratch_.path() / "cache", 64 << 20};
  WorkerLink link_{{server_->address()}, timing_};
  RemoteBlobs remote_{link_, cache_};
};

TEST_F(RemoteBlobsTest, TransfersResumeAfterCutConnections) {
  ByteLimitProxy proxy(server_->address(), kCut);
  WorkerLink link({proxy.address()}, timing_);
  RemoteBlobs remote(link, cache_);
  const std::string sent = RandomBytes(kBlobBytes, 1), kept = RandomBytes(kBlobBytes, 2);
  WriteFileAtomic(scratch_.path() / "result", sent);
  const FileDigest digest = remote.PutFile(scratch_.path() / "result");
  EXPECT_EQ(ReadFile(blobs_.Fetch(digest.sha256)), sent);
  const int cuts = proxy.cuts();
  EXPECT_GE(cuts, 3) << "nothing was ever cut: the test proves nothing";
  EXPECT_TRUE(fs::is_empty(scratch_.path() / "uploads"));
  const FileDigest stored = blobs_.PutBytes(kept);
  EXPECT_EQ(Read(remote, stored.sha256), kept);
  EXPECT_GE(proxy.cuts(), cuts + 3);
}

TEST_F(RemoteBlobsTest, ResultsAreCachedAndCheckpointsAreNot) {
  WriteFileAtomic(scratch_.path() / "result", "result");
  const FileDigest result = remote_.PutFile(scratch_.path() / "result");
  EXPECT_FALSE(fs::exists(scratch_.path() / "result"));
  EXPECT_EQ(cache_.bytes(), 6);
  const FileDigest state = remote_.PutBytes("state");
  WriteFileAtomic(scratch_.path() / "checkpoint", "checkpoint");
  const FileDigest checkpoint = DigestFile(scratch_.path() / "checkpoint");
  remote_.Adopt(scratch_.path() / "checkpoint", checkpoint);
  EXPECT_FALSE(fs::exists(scratch_.path() / "checkpoint"));
  EXPECT_EQ(cache_.bytes(), 6);
  for (const FileDigest& digest : {result, state, checkpoint}) {
    EXPECT_TRUE(remote_.Touch(digest));
    EXPECT_EQ(remote_.Look(digest.sha256)->digest.size_bytes, digest.size_bytes);
  }
  EXPECT_FALSE(remote_.Touch({Sha256Hex("none"), 4}));
  EXPECT_FALSE(remote_.Look(Sha256Hex("none")).has_value());
  // No server is needed for what is cached.
  server_->Shutdown(std::chrono::milliseconds(0));
  EXPECT_EQ(Read(remote_, result.sha256), "result");
}

TEST_F(RemoteBlobsTest, FileOfManyStagesIsFetchedOnce) {
  const FileDigest photo = blobs_.PutBytes(RandomBytes(100'000, 3));
  for (int stage = 0; stage < 5; ++stage) Read(remote_, photo.sha256);
  EXPECT_EQ(cache_.use().miss_bytes, photo.size_bytes);
  EXPECT_EQ(cache_.use().hit_bytes, 4 * photo.size_bytes);
  EXPECT_EQ(cache_.use().bytes, photo.size_bytes);
  EXPECT_EQ(cache_.use().limit_bytes, 64 << 20);
  WriteFileAtomic(scratch_.path() / "result", "result");
  Read(remote_, remote_.PutFile(scratch_.path() / "result").sha256);
  EXPECT_EQ(cache_.use().miss_bytes, photo.size_bytes) << "its own result was not fetched";
}

TEST_F(RemoteBlobsTest, RemovesOnlyWhatNothingNames) {
  const FileDigest state = remote_.PutBytes("state");
  const StoredBlob blob = remote_.Look(state.sha256).value();
  remote_.Touch(state);
  EXPECT_FALSE(remote_.RemoveIfUntouched(blob)) << "touched since";
  EXPECT_TRUE(remote_.RemoveIfUntouched(remote_.Look(state.sha256).value()));
  EXPECT_FALSE(remote_.Look(state.sha256).has_value());
  SceneRecord scene;
  scene.name = "scenes/named";
  scene.files = {{"a.jpg", remote_.PutBytes("photo")}};
  store_.CreateScene(scene, {}, {});
  EXPECT_FALSE(remote_.RemoveIfUntouched(remote_.Look(Sha256Hex("photo")).value()));
}

TEST_F(RemoteBlobsTest, RefusesBytesOfOtherDigest) {
  WriteFileAtomic(scratch_.path() / "result", "bytes");
  const FileDigest wrong{Sha256Hex("other"), 5};
  EXPECT_EQ(ReasonOfThrown([&] { remote_.Adopt(scratch_.path() / "result", wrong); }),
            "DIGEST_MISMATCH");
  EXPECT_FALSE(blobs_.Look(wrong.sha256).has_value());
  EXPECT_EQ(ReasonOfThrown([&] { Read(remote_, Sha256Hex("none")); }), "BLOB_MISSING");
}

TEST_F(RemoteBlobsTest, DamagedBlobIsSetAsideAndNotCached) {
  const FileDigest digest = blobs_.PutBytes("good bytes");
  const fs::path file = blobs_.Fetch(digest.sha256);
  fs::permissions(file, fs::perms::owner_all);
  std::ofstream(file) << "other byte";
  EXPECT_EQ(ReasonOfThrown([&] { Read(remote_, digest.sha256); }), "BLOB_DAMAGED");
  EXPECT_EQ(cache_.bytes(), 0);
  EXPECT_EQ(ReasonOfThrown([&] { Read(remote_, digest.sha256); }), "BLOB_MISSING");
  blobs_.PutBytes("good bytes");
  EXPECT_EQ(Read(remote_, digest.sha256), "good bytes");
}

TEST_F(RemoteBlobsTest, UnreachableServerIsUnavailable) {
  WorkerLink link({"127.0.0.1:1"}, {std::chrono::seconds(1), std::chrono::milliseconds(200)});
  const RemoteBlobs remote(link, cache_);
  try {
    remote.Touch({Sha256Hex("a"), 1});
    FAIL() << "nothing was there";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUnavailable);
    EXPECT_THAT(e.what(), HasSubstr("127.0.0.1:1 does not answer"));
  }
  EXPECT_THROW(WorkerLink({"example.org:1", "secret"}, timing_), Error)
      << "a token would travel unencrypted";
}

TEST_F(RemoteBlobsTest, WorkerOfOtherProtocolIsRefused) {
  EXPECT_GT(link_.Greet("test").times.lease_ms, 0);
  EXPECT_EQ(ReasonOfThrown([&] { link_.Greet("test", kWorkerProtocol + 1); }), "WORKER_VERSION");
  RemoteStore newer(link_, "9.9.9", kWorkerProtocol + 1);
  try {
    newer.Claim("w", 1000);
    FAIL() << "it was taken";
  } catch (const Error& e) {
    EXPECT_TRUE(HasReason(e, ErrorReason::kWorkerVersion));
    EXPECT_THAT(e.what(), HasSubstr("'9.9.9' and speaks protocol"));
  }
}

TEST(WorkerProtocolTest, TakesItsOwnAndThePreviousOne) {
  EXPECT_NO_THROW(RequireWorkerProtocol(5, 5, "b", "b"));
  EXPECT_NO_THROW(RequireWorkerProtocol(5, 4, "b", "a"));
  const auto refusal = [](int worker) {
    try {
      RequireWorkerProtocol(5, worker, "server", "worker");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal(3), HasSubstr("install the server's version of color3d-worker"));
  EXPECT_THAT(refusal(6), HasSubstr("install the worker's version of the server"));
}

}  // namespace
}  // namespace color3d::testing
