#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/ops/address.h"
#include "tests/support/rpc_fixture.h"

namespace color3d::testing {
namespace {
using ::testing::HasSubstr;
using BlobSceneRpcTest = RpcTest;

TEST_F(BlobSceneRpcTest, UploadResumesAtAnOffset) {
  const std::string content(100'000, 'x');
  const v1::Digest digest = DigestOf(content);
  const std::string resource =
      "uploads/" + std::string(kUuid) + "/blobs/" + digest.sha256() + "/100000";
  int64_t committed = 0;
  ASSERT_TRUE(WriteAt(resource, 0, content.substr(0, 30'000), false, &committed).ok());
  EXPECT_EQ(committed, 30'000);
  grpc::ClientContext query_context;
  google::bytestream::QueryWriteStatusRequest query;
  query.set_resource_name(resource);
  google::bytestream::QueryWriteStatusResponse status;
  ASSERT_TRUE(client_->bytes->QueryWriteStatus(&query_context, query, &status).ok());
  EXPECT_EQ(status.committed_size(), 30'000);
  EXPECT_FALSE(status.complete());
  EXPECT_EQ(ReasonOfStatus(WriteAt(resource, 0, "x", false)), "OFFSET_MISMATCH");
  ASSERT_TRUE(WriteAt(resource, 30'000, content.substr(30'000), true, &committed).ok());
  EXPECT_EQ(committed, 100'000);
  EXPECT_EQ(client_->Download(digest), content);
  ASSERT_TRUE(WriteAt(resource, 0, "x", false, &committed).ok()) << "it is there already";
  EXPECT_EQ(committed, 100'000);
}

TEST_F(BlobSceneRpcTest, ReadsAnyRange) {
  const v1::Digest digest = client_->Upload("0123456789");
  const auto read = [&](int64_t offset, int64_t limit, std::string* content) {
    grpc::ClientContext context;
    google::bytestream::ReadRequest request;
    request.set_resource_name("blobs/" + digest.sha256() + "/10");
    request.set_read_offset(offset);
    request.set_read_limit(limit);
    auto stream = client_->bytes->Read(&context, request);
    google::bytestream::ReadResponse response;
    content->clear();
    while (stream->Read(&response)) *content += response.data();
    return stream->Finish();
  };
  std::string content;
  EXPECT_TRUE(read(3, 4, &content).ok());
  EXPECT_EQ(content, "3456");
  EXPECT_TRUE(read(8, 0, &content).ok());
  EXPECT_EQ(content, "89");
  EXPECT_TRUE(read(10, 0, &content).ok());
  EXPECT_EQ(content, "");
  EXPECT_EQ(read(11, 0, &content).error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(read(-1, 0, &content).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(BlobSceneRpcTest, CorruptUploadIsRefusedAndAbsent) {
  const v1::Digest digest = DigestOf("right");
  const std::string resource = "uploads/u/blobs/" + digest.sha256() + "/5";
  const grpc::Status status = WriteAt(resource, 0, "wrong", true);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ReasonOfStatus(status), "DIGEST_MISMATCH");
  v1::FindMissingBlobsRequest request;
  *request.add_digests() = digest;
  *request.add_digests() = client_->Upload("there");
  *request.add_digests() = digest;
  grpc::ClientContext context;
  v1::FindMissingBlobsResponse response;
  ASSERT_TRUE(client_->blobs->FindMissingBlobs(&context, request, &response).ok());
  ASSERT_EQ(response.missing_size(), 1) << "once, although named twice";
  EXPECT_EQ(response.missing(0).sha256(), digest.sha256());
}

TEST_F(BlobSceneRpcTest, HostileResourceNames) {
  for (const char* resource : {"", "uploads/../blobs/x/1", "blobs/x", "uploads/u/blobs/zz/-1"}) {
    EXPECT_EQ(WriteAt(resource, 0, "x", false).error_code(), grpc::StatusCode::INVALID_ARGUMENT)
        << resource;
  }
}

TEST_F(BlobSceneRpcTest, CommitChecksEveryFile) {
  v1::Scene scene;
  grpc::Status status = Commit({{"a.png", TinyPng()},
                                {"b.jpg", "no image"},
                                {"c.png", TinyPng().substr(0, 40)},
                                {"d.tif", "missing"}},
                               &scene);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ReasonOfStatus(status), "SCENE_INVALID");
  const google::rpc::BadRequest bad = BadRequestOf(status);
  ASSERT_EQ(bad.field_violations_size(), 3);
  EXPECT_EQ(bad.field_violations(0).field(), "b.jpg");
  EXPECT_THAT(status.error_message(), HasSubstr("b.jpg"));
  EXPECT_THAT(status.error_message(), HasSubstr("was not uploaded"));
  status = Commit({{"a.png", TinyPng()}}, &scene);
  EXPECT_THAT(status.error_message(), HasSubstr("one photograph"));
  status = Commit({{"notes.txt", "hello"}}, &scene);
  EXPECT_THAT(status.error_message(), HasSubstr("no photographs"));
  EXPECT_EQ(Commit({{"../a.png", TinyPng()}}, &scene).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Commit({{"a", "1"}, {"a/b", "2"}}, &scene).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(BlobSceneRpcTest, ManyBadFilesFitIntoTheStatus) {
  std::vector<std::pair<std::string, std::string>> files;
  for (int i = 0; i < 300; ++i) {
    files.push_back({"a/rather/long/path/for/a/photograph/" + std::to_string(i) + ".jpg", "bad"});
  }
  v1::Scene scene;
  const grpc::Status status = Commit(files, &scene);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("and 297 more"));
}

TEST_F(BlobSceneRpcTest, PicturesInAugmentAreCheckedButNoPhotos) {
  v1::Scene scene;
  ASSERT_TRUE(
      Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"augment/c.png", TinyPng()}}, &scene)
          .ok());
  EXPECT_EQ(scene.photo_count(), 2);
  const grpc::Status status = Commit({{"a.png", TinyPng()},
                                      {"b.png", TinyPng()},
                                      {"augment/c.png", "no image"},
                                      {"augment/notes.txt", "hello"}},
                                     &scene);
  const google::rpc::BadRequest bad = BadRequestOf(status);
  ASSERT_EQ(bad.field_violations_size(), 2);
  EXPECT_EQ(bad.field_violations(1).field(), "augment/notes.txt");
}

TEST_F(BlobSceneRpcTest, LayoutsAreRecognised) {
  v1::Scene scene;
  ASSERT_TRUE(Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_PHOTOS);
  EXPECT_EQ(scene.photo_count(), 2);
  EXPECT_EQ(scene.state(), v1::Scene::STATE_ACTIVE);
  std::vector<std::pair<std::string, std::string>> files = {{"images/a.png", TinyPng()},
                                                            {"images/b.png", TinyPng()},
                                                            {"sparse/0/cameras.bin", "1"},
                                                            {"sparse/0/images.bin", "2"}};
  const grpc::Status status = Commit(files, &scene);
  EXPECT_THAT(status.error_message(), HasSubstr("not whole"));
  files.push_back({"sparse/0/points3D.bin", "3"});
  ASSERT_TRUE(Commit(files, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_COLMAP);
  const std::string json = R"({"frames": [{"file_path": "a.png"}]})";
  ASSERT_TRUE(
      Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"transforms.json", json}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_TRANSFORMS);
  EXPECT_THAT(Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"transforms.json", "{"}}, &scene)
                  .error_message(),
              HasSubstr("transforms.json"));
}

TEST_F(BlobSceneRpcTest, BusyAddressIsExplained) {
  RpcServerOptions options;
  options.listen = server_->address();
  try {
    RpcServer second(options, store_, blobs_, uploads_, SystemClock());
    FAIL() << "two servers on one port";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("in use"));
    EXPECT_THAT(e.what(), HasSubstr("--listen"));
  }
  EXPECT_TRUE(IsLoopback("127.0.0.1:1"));
  EXPECT_TRUE(IsLoopback("[::1]:1"));
  EXPECT_TRUE(IsLoopback("unix:color3d.sock"));
  EXPECT_FALSE(IsLoopback("0.0.0.0:1"));
  EXPECT_THROW(IsLoopback("nonsense"), Error);
}

}  // namespace
}  // namespace color3d::testing
