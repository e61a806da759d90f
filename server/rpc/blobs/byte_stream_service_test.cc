#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <fstream>
#include <thread>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using ByteStreamServiceTest = RpcTest;

TEST_F(ByteStreamServiceTest, UploadResumesAtAnOffset) {
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

TEST_F(ByteStreamServiceTest, ReadsAnyRange) {
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

TEST_F(ByteStreamServiceTest, CorruptUploadIsRefusedAndAbsent) {
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

TEST_F(ByteStreamServiceTest, HostileResourceNames) {
  for (const char* resource : {"", "uploads/../blobs/x/1", "blobs/x", "uploads/u/blobs/zz/-1"}) {
    EXPECT_EQ(WriteAt(resource, 0, "x", false).error_code(), grpc::StatusCode::INVALID_ARGUMENT)
        << resource;
  }
}

// A disk that returns other bytes: the client is told, and an upload heals it.
TEST_F(ByteStreamServiceTest, DamagedBlobsAreSaidToBeAndHealed) {
  const std::string content(700'000, 'x');
  const v1::Digest digest = client_->Upload(content);
  const auto file = blobs_.Fetch(digest.sha256());
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(5) << 'y';
  const auto read = [&] {
    grpc::ClientContext context;
    google::bytestream::ReadRequest request;
    request.set_resource_name("blobs/" + digest.sha256() + "/700000");
    auto stream = client_->bytes->Read(&context, request);
    google::bytestream::ReadResponse response;
    while (stream->Read(&response)) {
    }
    return ReasonOfStatus(stream->Finish());
  };
  EXPECT_EQ(read(), "BLOB_DAMAGED");
  EXPECT_EQ(blobs_.damaged(), 1) << "what a metric shows";
  EXPECT_EQ(read(), "BLOB_MISSING");
  client_->Upload(content);
  EXPECT_EQ(client_->Download(digest), content);
}

// A disk that does not answer those who transfer keeps nobody else waiting.
TEST_F(ByteStreamServiceTest, TransfersKeepNoOtherCallWaiting) {
  constexpr int kTransfers = 12;
  class HangingBlobs : public FileBlobStore {
   public:
    using FileBlobStore::FileBlobStore;
    std::filesystem::path Fetch(const std::string& sha256) const override {
      while (!released) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return FileBlobStore::Fetch(sha256);
    }
    std::atomic<bool> released{false};
  };
  HangingBlobs hanging(scratch_.path() / "blobs", BlobStoreOptions{0});
  RpcServerOptions options;
  options.listen = "127.0.0.1:0";
  RpcServer server(options, store_, hanging, uploads_, SystemClock());
  TestClient client(server.address());
  const std::string scene = client_->MakeScene().name();
  const v1::Digest digest = client_->Upload("0123456789");
  std::deque<grpc::ClientContext> contexts(kTransfers);
  std::vector<std::unique_ptr<grpc::ClientReader<google::bytestream::ReadResponse>>> reads;
  google::bytestream::ReadRequest request;
  request.set_resource_name("blobs/" + digest.sha256() + "/10");
  for (grpc::ClientContext& context : contexts) {
    reads.push_back(client.bytes->Read(&context, request));
  }
  for (int i = 0; i < 500 && server.open().downloads < options.bulk_threads; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
  v1::GetSceneRequest get;
  get.set_name(scene);
  v1::Scene got;
  EXPECT_TRUE(client.scenes->GetScene(&context, get, &got).ok());
  hanging.released = true;
  google::bytestream::ReadResponse response;
  for (const auto& read : reads) {
    EXPECT_TRUE(read->Read(&response));
    EXPECT_FALSE(read->Read(&response));
    EXPECT_TRUE(read->Finish().ok());
  }
}

// A place is for those who do something with it.
class SilentStreamsTest : public RpcTest {
 protected:
  SilentStreamsTest() {
    RpcServerOptions options;
    options.listen = "127.0.0.1:0";
    options.limits.stream_silence = std::chrono::milliseconds(300);
    options.limits.max_writes = 4;
    options.limits.max_reads = 4;
    options.live.silence = std::chrono::milliseconds(300);
    options.inference.target = "unix:" + (scratch_.path() / "nobody").string();
    impatient_ = std::make_unique<RpcServer>(options, store_, blobs_, uploads_, SystemClock());
    other_ = std::make_unique<TestClient>(impatient_->address());
  }
  bool BecomesTrue(const std::function<bool()>& condition) const {
    for (int i = 0; i < 1000 && !condition(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return condition();
  }

  std::unique_ptr<RpcServer> impatient_;
  std::unique_ptr<TestClient> other_;
};

TEST_F(SilentStreamsTest, AnUploadThatSendsNothingGivesItsPlaceBackAndGoesOn) {
  const std::string content = "0123456789";
  const v1::Digest digest = DigestOf(content);
  google::bytestream::WriteRequest request;
  request.set_resource_name("uploads/u/blobs/" + digest.sha256() + "/10");
  request.set_data(content.substr(0, 4));
  std::deque<grpc::ClientContext> contexts(4);
  std::vector<std::unique_ptr<grpc::ClientWriter<google::bytestream::WriteRequest>>> streams;
  std::deque<google::bytestream::WriteResponse> answers(4);
  for (size_t i = 0; i < 4; ++i) streams.push_back(other_->bytes->Write(&contexts[i], &answers[i]));
  ASSERT_TRUE(streams[0]->Write(request));  // the others say nothing at all
  ASSERT_TRUE(BecomesTrue([&] { return impatient_->open().uploads == 4; }));
  ASSERT_TRUE(BecomesTrue([&] { return impatient_->open().uploads == 0; })) << "for ever";
  for (const auto& stream : streams) {
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
    EXPECT_EQ(ReasonOfStatus(status), "UPLOAD_SILENT");
  }
  google::bytestream::QueryWriteStatusRequest query;
  query.set_resource_name(request.resource_name());
  google::bytestream::QueryWriteStatusResponse so_far;
  grpc::ClientContext context;
  ASSERT_TRUE(other_->bytes->QueryWriteStatus(&context, query, &so_far).ok());
  EXPECT_EQ(so_far.committed_size(), 4);
  EXPECT_EQ(other_->Download(other_->Upload(content)), content);
}

TEST_F(SilentStreamsTest, ADownloadThatNobodyReadsGivesItsPlaceBack) {
  const std::string content(8 << 20, 'x');  // more than lies in buffers on the way
  const v1::Digest digest = DigestOf(content);
  store_.HoldBlob("", blobs_.PutBytes(content));
  google::bytestream::ReadRequest request;
  request.set_resource_name("blobs/" + digest.sha256() + "/" + std::to_string(content.size()));
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
  TestClient slow(grpc::CreateCustomChannel(
      impatient_->address(), grpc::InsecureChannelCredentials(), arguments));
  std::deque<grpc::ClientContext> contexts(4);
  std::vector<std::unique_ptr<grpc::ClientReader<google::bytestream::ReadResponse>>> streams;
  for (grpc::ClientContext& context : contexts) {
    streams.push_back(slow.bytes->Read(&context, request));
  }
  ASSERT_TRUE(BecomesTrue([&] { return impatient_->open().downloads == 4; }));
  ASSERT_TRUE(BecomesTrue([&] { return impatient_->open().downloads == 0; })) << "for ever";
  EXPECT_EQ(other_->Download(digest).size(), content.size());
  google::bytestream::ReadResponse response;
  for (const auto& stream : streams) {
    while (stream->Read(&response)) {
    }
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
}

TEST_F(SilentStreamsTest, ALiveStreamToWhichNoPictureComesEnds) {
  grpc::ClientContext context;
  const auto stream = other_->colorizers->ColorizeImages(&context);
  v1::ColorizeImagesResponse response;
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
  EXPECT_EQ(ReasonOfStatus(status), "STREAM_SILENT");
}

}  // namespace
}  // namespace color3d::testing
