#include "server/storage/upload_store.h"

#include <gtest/gtest.h>

#include "tests/support/service/storage_fixture.h"

namespace color3d {
namespace {
using UploadStoreTest = StorageTest;

TEST_F(UploadStoreTest, ResumesUploadAtCommittedSize) {
  const UploadName name{"3f0c", DigestOf("hello world")};
  EXPECT_EQ(uploads_.CommittedSize(name), 0);
  {
    auto writer = uploads_.Open(name, 0);
    writer->Append(0, "hello");
  }  // the connection breaks
  EXPECT_EQ(uploads_.CommittedSize(name), 5);
  EXPECT_EQ(ReasonThrown([&] { uploads_.Open(name, 0); }), "OFFSET_MISMATCH");
  auto writer = uploads_.Open(name, 5);
  writer->Append(5, " wor");
  EXPECT_EQ(ReasonThrown([&] { writer->Append(8, "ld"); }), "OFFSET_MISMATCH");
  EXPECT_EQ(ReasonThrown([&] { writer->Finish(); }), "SIZE_MISMATCH");
  writer->Append(9, "ld");
  EXPECT_EQ(ReasonThrown([&] { writer->Append(11, "!"); }), "SIZE_MISMATCH");
  writer->Finish();
  EXPECT_TRUE(blobs_.Touch(name.digest));
  EXPECT_EQ(ReadFile(blobs_.Fetch(name.digest.sha256)), "hello world");
  EXPECT_TRUE(ListFiles(scratch_.path() / "uploads").empty());
}

TEST_F(UploadStoreTest, DropsUploadWithWrongDigest) {
  const UploadName name{"u", DigestOf("right")};
  auto writer = uploads_.Open(name, 0);
  writer->Append(0, "wrong");
  EXPECT_EQ(ReasonThrown([&] { writer->Finish(); }), "DIGEST_MISMATCH");
  writer.reset();
  EXPECT_FALSE(blobs_.Touch(name.digest));
  EXPECT_EQ(uploads_.CommittedSize(name), 0) << "starts afresh";
}

TEST_F(UploadStoreTest, ReconnectedClientTakesOverUpload) {
  const UploadName name{"u", DigestOf("abcdef")};
  auto first = uploads_.Open(name, 0);
  first->Append(0, "abc");
  auto second = uploads_.Open(name, 3);
  EXPECT_EQ(ReasonThrown([&] { first->Append(3, "xyz"); }), "UPLOAD_TAKEN_OVER");
  first.reset();
  second->Append(3, "def");
  second->Finish();
  EXPECT_TRUE(blobs_.Touch(name.digest));
}

TEST_F(UploadStoreTest, RefusesHostileNamesAndSizes) {
  EXPECT_THROW(uploads_.Open({"../../x", DigestOf("a")}, 0), Error);
  EXPECT_THROW(uploads_.Open({"", DigestOf("a")}, 0), Error);
  EXPECT_THROW(uploads_.Open({"u", {"zz", 1}}, 0), Error);
  EXPECT_THROW(uploads_.Open({"u", {Sha256Hex("a"), -1}}, 0), Error);
  EXPECT_THROW(uploads_.Open({"u", {Sha256Hex("a"), 1001}}, 0), Error);
  EXPECT_TRUE(ListFiles(scratch_.path() / "uploads").empty());
}

TEST_F(UploadStoreTest, RemovesDeadUploads) {
  const UploadName name{"u", DigestOf("abc")};
  uploads_.Open(name, 0)->Append(0, "a");
  EXPECT_EQ(uploads_.ReapOlderThan(std::chrono::hours(24)).uploads, 0);
  for (const std::string& file : ListFiles(scratch_.path() / "uploads")) {
    MakeOld(scratch_.path() / "uploads" / file, 25);
  }
  EXPECT_EQ(uploads_.ReapOlderThan(std::chrono::hours(24)).uploads, 0)
      << "the clock may have been set";
  EXPECT_EQ(uploads_.ReapOlderThan(std::chrono::hours(24)).uploads, 1);
  EXPECT_EQ(uploads_.CommittedSize(name), 0);
}

// Counts the announced size during a write and the size on disk afterwards, also after a restart.
TEST_F(UploadStoreTest, CountsBytesOfUnfinishedUploads) {
  const UploadName abc{"u1", DigestOf("abc"), "attic"}, de{"u2", DigestOf("de"), "attic"};
  int64_t seen = -1;
  const auto look = [&](UploadStore& uploads, const std::string& owner = "attic") {
    uploads.Open({"look", DigestOf(""), owner}, 0, [&](int64_t bytes) { seen = bytes; });
    return seen;
  };
  const auto refuse = [](int64_t) { throw ServiceError(ErrorReason::kQuotaExceeded, "no"); };
  auto first = uploads_.Open(abc, 0), second = uploads_.Open(de, 0);
  EXPECT_EQ(look(uploads_), 5);
  EXPECT_EQ(look(uploads_, "cellar"), 0);
  EXPECT_EQ(ReasonThrown([&] {
              uploads_.Open({"u3", DigestOf("x"), "attic"}, 0, refuse);
            }),
            "QUOTA_EXCEEDED");
  EXPECT_EQ(look(uploads_), 5) << "what was refused takes nothing";
  first->Append(0, "a");
  first.reset();
  EXPECT_EQ(look(uploads_), 1 + 2);
  UploadStore again(scratch_.path() / "uploads", blobs_, 1000);
  EXPECT_EQ(look(again), 1);
  second->Append(0, "de");
  second->Finish();
  second.reset();
  EXPECT_EQ(look(uploads_), 1) << "it is a blob now";
  first = uploads_.Open(abc, 1);
  EXPECT_EQ(look(uploads_), 3);
}

TEST_F(UploadStoreTest, StoresEmptyBlob) {
  const UploadName name{"u", DigestOf("")};
  uploads_.Open(name, 0)->Finish();
  EXPECT_TRUE(blobs_.Touch(name.digest));
}

TEST_F(UploadStoreTest, EmptyUploadLeavesNoFile) {
  uploads_.Open({"u", DigestOf("abc")}, 0).reset();
  EXPECT_EQ(ReasonThrown([&] { uploads_.Open({"v", DigestOf("abc")}, 2); }), "OFFSET_MISMATCH");
  EXPECT_TRUE(ListFiles(scratch_.path() / "uploads").empty());
}

TEST_F(UploadStoreTest, LimitsUnfinishedUploadsOfOwner) {
  const FileDigest digest = DigestOf("abc");
  const auto leave = [&](const std::string& owner, int i) {
    uploads_.Open({"u" + std::to_string(i), digest, owner}, 0)->Append(0, "a");
  };
  for (int i = 0; i < 1000; ++i) leave("attic", i);
  EXPECT_EQ(ReasonThrown([&] { leave("attic", 1000); }), "QUOTA_EXCEEDED");
  leave("cellar", 0);
  uploads_.Open({"u7", digest, "attic"}, 1)->Append(1, "b");  // resumes the partial upload
}

}  // namespace
}  // namespace color3d
