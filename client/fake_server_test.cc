// The client library against a server that breaks connections on purpose.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {

namespace bs = google::bytestream;
namespace fs = std::filesystem;
using ::testing::ElementsAre;

std::string Digits(const std::string& resource) { return resource.substr(resource.find("blobs/")); }

// Holds blobs by "blobs/{sha}/{size}"; drops every stream but the last after `limit` bytes.
class FakeBlobs final : public bs::ByteStream::Service, public v1::BlobService::Service {
 public:
  std::map<std::string, std::string> blobs;
  std::map<std::string, std::string> uploads;
  int drops = 0;  // streams that still are to be dropped
  size_t limit = 0;
  int writes = 0;
  bool corrupt = false;

  grpc::Status FindMissingBlobs(grpc::ServerContext*,
                                const v1::FindMissingBlobsRequest* request,
                                v1::FindMissingBlobsResponse* response) override {
    for (const v1::Digest& digest : request->digests()) {
      const std::string name =
          "blobs/" + digest.sha256() + "/" + std::to_string(digest.size_bytes());
      if (!blobs.contains(name)) *response->add_missing() = digest;
    }
    return grpc::Status::OK;
  }
  grpc::Status Write(grpc::ServerContext*,
                     grpc::ServerReader<bs::WriteRequest>* reader,
                     bs::WriteResponse* response) override {
    ++writes;
    bs::WriteRequest request;
    std::string name;
    size_t taken = 0;
    while (reader->Read(&request)) {
      if (!request.resource_name().empty()) name = request.resource_name();
      std::string& upload = uploads[name];
      if (request.write_offset() != static_cast<int64_t>(upload.size())) {
        return {grpc::StatusCode::INVALID_ARGUMENT, "wrong offset"};
      }
      upload += request.data();
      taken += request.data().size();
      if (drops > 0 && taken >= limit) {
        --drops;
        return {grpc::StatusCode::UNAVAILABLE, "dropped on purpose"};
      }
      if (request.finish_write()) {
        blobs[Digits(name)] = upload;
        response->set_committed_size(static_cast<int64_t>(upload.size()));
        return grpc::Status::OK;
      }
    }
    return {grpc::StatusCode::INVALID_ARGUMENT, "no end"};
  }
  grpc::Status QueryWriteStatus(grpc::ServerContext*,
                                const bs::QueryWriteStatusRequest* request,
                                bs::QueryWriteStatusResponse* response) override {
    response->set_committed_size(static_cast<int64_t>(uploads[request->resource_name()].size()));
    return grpc::Status::OK;
  }
  grpc::Status Read(grpc::ServerContext*,
                    const bs::ReadRequest* request,
                    grpc::ServerWriter<bs::ReadResponse>* writer) override {
    const auto found = blobs.find(request->resource_name());
    if (found == blobs.end()) return {grpc::StatusCode::NOT_FOUND, "no such blob"};
    std::string bytes = found->second.substr(static_cast<size_t>(request->read_offset()));
    if (request->read_limit() > 0)
      bytes.resize(std::min<size_t>(bytes.size(), request->read_limit()));
    if (corrupt && !bytes.empty()) bytes[0] ^= 1;
    const bool drop = drops > 0;
    if (drop) --drops, bytes.resize(std::min(bytes.size(), limit));
    for (size_t at = 0; at < bytes.size(); at += 1000) {
      bs::ReadResponse response;
      response.set_data(bytes.substr(at, 1000));
      writer->Write(response);
    }
    return drop ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "dropped on purpose")
                : grpc::Status::OK;
  }
};

// Streams scripted one after the other: revisions to send, then a status.
class FakeJobs final : public v1::JobService::Service {
 public:
  struct Stream {
    std::vector<int64_t> revisions;
    grpc::Status end;
    int hold_ms = 0;
  };
  std::vector<Stream> script;
  std::vector<int64_t> asked;  // after_revision of each stream

  grpc::Status WatchJobs(grpc::ServerContext* context,
                         const v1::WatchJobsRequest* request,
                         grpc::ServerWriter<v1::JobEvent>* writer) override {
    asked.push_back(request->after_revision());
    if (asked.size() > script.size()) return grpc::Status::OK;
    const Stream& stream = script[asked.size() - 1];
    for (const int64_t revision : stream.revisions) {
      v1::JobEvent event;
      event.set_revision(revision);
      event.set_kind(v1::JobEvent::KIND_STATE);
      event.mutable_job()->set_name("jobs/1");
      writer->Write(event);
    }
    for (int waited = 0; waited < stream.hold_ms && !context->IsCancelled(); waited += 20) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return stream.end;
  }
};

class FakeServerTest : public ::testing::Test {
 protected:
  FakeServerTest() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(static_cast<bs::ByteStream::Service*>(&blobs_));
    builder.RegisterService(static_cast<v1::BlobService::Service*>(&blobs_));
    builder.RegisterService(&jobs_);
    server_ = builder.BuildAndStart();
    connection_ = std::make_unique<Connection>("127.0.0.1:" + std::to_string(port), cancel_);
    for (int i = 0; i < 3'000'000; ++i) bytes_ += static_cast<char>(i * 2654435761u >> 13);
    digest_ = {Sha256Hex(bytes_), static_cast<int64_t>(bytes_.size())};
    name_ = "blobs/" + digest_.sha256 + "/" + std::to_string(digest_.size_bytes);
  }
  void Upload(const std::string& bytes) {
    WriteFileAtomic(file_, bytes);
    UploadMissing(*connection_, {{file_, digest_}}, [this](int64_t done, int64_t total) {
      EXPECT_LE(done, total);
      last_done_ = done;
    });
  }
  void Download() {
    DownloadBlob(*connection_, digest_, target_, [](int64_t) {});
  }

  CancellationToken cancel_;
  FakeBlobs blobs_;
  FakeJobs jobs_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Connection> connection_;
  ScratchFolder scratch_;
  fs::path file_ = scratch_.path() / "file";
  fs::path target_ = scratch_.path() / "out/deep/result.bin";
  std::string bytes_;
  FileDigest digest_;
  std::string name_;
  int64_t last_done_ = -1;
};

TEST_F(FakeServerTest, UploadGoesOnWhereTheConnectionBroke) {
  blobs_.drops = 2;
  blobs_.limit = 1'000'000;
  Upload(bytes_);
  EXPECT_EQ(blobs_.blobs[name_], bytes_);
  EXPECT_EQ(blobs_.writes, 3);
  EXPECT_EQ(blobs_.uploads.size(), 1u);
  EXPECT_EQ(last_done_, digest_.size_bytes);
  Upload(bytes_);  // it is there: nothing is sent
  EXPECT_EQ(blobs_.writes, 3);
}

TEST_F(FakeServerTest, EmptyFilesTravelToo) {
  bytes_.clear();
  digest_ = {Sha256Hex(""), 0};
  name_ = "blobs/" + digest_.sha256 + "/0";
  Upload("");
  ASSERT_TRUE(blobs_.blobs.contains(name_));
  Download();
  EXPECT_EQ(ReadFile(target_), "");
}

TEST_F(FakeServerTest, FileThatBecameShorterIsNamed) {
  try {
    Upload(bytes_.substr(0, 1000));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("changed while it was read"));
  }
}

TEST_F(FakeServerTest, CancelEndsAnUpload) {
  cancel_.Cancel();
  EXPECT_THROW(Upload(bytes_), Error);
}

TEST_F(FakeServerTest, DownloadResumesAndLeavesNothingElseBehind) {
  blobs_.blobs[name_] = bytes_;
  blobs_.drops = 2;
  blobs_.limit = 700'000;
  Download();
  EXPECT_EQ(ReadFile(target_), bytes_);
  EXPECT_EQ(std::distance(fs::directory_iterator(target_.parent_path()), {}), 1);
  blobs_.blobs.clear();
  EXPECT_NO_THROW(Download());  // it is there already
}

TEST_F(FakeServerTest, DownloadRefusesOtherBytes) {
  blobs_.blobs[name_] = bytes_;
  blobs_.corrupt = true;
  try {
    Download();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kDataLoss);
  }
  EXPECT_FALSE(fs::exists(target_));
}

TEST_F(FakeServerTest, DownloadOfAMissingBlobIsNotFound) {
  try {
    Download();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kNotFound);
  }
}

TEST_F(FakeServerTest, WatchResumesAtTheLastRevision) {
  const grpc::Status broken(grpc::StatusCode::UNAVAILABLE, "broken");
  jobs_.script = {{{3, 5}, broken, 2200}, {{8}, broken}, {{9}, grpc::Status::OK}};
  std::vector<int64_t> seen;
  const WatchEnd end = WatchJobs(
      *connection_,
      {"jobs/1"},
      [&](const v1::JobEvent& event) { seen.push_back(event.revision()); },
      [] { return true; });
  EXPECT_EQ(end, WatchEnd::kFinished);
  EXPECT_THAT(seen, ElementsAre(3, 5, 8, 9));
  EXPECT_THAT(jobs_.asked, ElementsAre(0, 5, 8));
}

TEST_F(FakeServerTest, WatchTakesTheWholeStateAgainWhenTheFirstStreamBroke) {
  const grpc::Status broken(grpc::StatusCode::UNAVAILABLE, "broken");
  jobs_.script = {{{7}, broken}, {{7}, grpc::Status::OK}};
  WatchJobs(
      *connection_, {"jobs/1"}, [](const v1::JobEvent&) {}, [] { return true; });
  EXPECT_THAT(jobs_.asked, ElementsAre(0, 0));
}

TEST_F(FakeServerTest, WatchStartsAnewWhenItsRevisionIsGone) {
  const grpc::Status broken(grpc::StatusCode::UNAVAILABLE, "broken");
  const grpc::Status gone(grpc::StatusCode::OUT_OF_RANGE, "compacted");
  jobs_.script = {{{4}, broken, 2200}, {{}, gone}, {{6}, grpc::Status::OK}};
  WatchJobs(
      *connection_, {"jobs/1"}, [](const v1::JobEvent&) {}, [] { return true; });
  EXPECT_THAT(jobs_.asked, ElementsAre(0, 4, 0));
}

TEST_F(FakeServerTest, WatchStopsWhenAskedAndThrowsWhatTheServerSays) {
  jobs_.script = {{{1}, grpc::Status::OK, 5000},
                  {{}, grpc::Status(grpc::StatusCode::NOT_FOUND, "no such job")}};
  int events = 0;
  const auto count = [&](const v1::JobEvent&) { ++events; };
  EXPECT_EQ(WatchJobs(*connection_, {"jobs/1"}, count, [&] { return events == 0; }),
            WatchEnd::kStopped);
  EXPECT_THROW(WatchJobs(*connection_, {"jobs/1"}, count, [] { return true; }), RpcError);
}

TEST(Connection, SaysHowToStartAServer) {
  const CancellationToken cancel;
  const auto begun = std::chrono::steady_clock::now();
  try {
    Connection("127.0.0.1:1", cancel);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUnavailable);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("cannot reach a server at 127.0.0.1:1"));
    EXPECT_THAT(e.what(), ::testing::HasSubstr("color3d-server serve"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(5));
}

}  // namespace
}  // namespace color3d::client
