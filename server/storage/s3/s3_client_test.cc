// The client against a store that fails as Amazon's and MinIO's references document, and verifies
// each signature by itself.
#include "server/storage/s3/s3_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "core/base/digest.h"
#include "core/base/files.h"
#include "tests/support/service/s3_process.h"

namespace color3d {
namespace {
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::S3Process;

constexpr char kUnavailable[] = R"("kind": "status", "status": 503, "code": "SlowDown")";

class S3ClientTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!S3Process::IsInstalled()) GTEST_SKIP() << "NOT TESTED: python3 is missing";
    server_ = std::make_unique<S3Process>(scratch_.path());
    Connect(server_->Options());
  }
  void Connect(S3Options options) { client_ = std::make_unique<S3Client>(std::move(options)); }

  // Message of the S3Error that `body` throws; empty: none.
  static std::string ProblemOf(const std::function<void()>& body) {
    try {
      body();
    } catch (const S3Error& e) {
      return e.what();
    }
    return "";
  }
  std::string Get(const std::string& key, int64_t offset, int64_t size) {
    std::string bytes;
    EXPECT_TRUE(client_->Get(key, offset, size, [&](std::string_view part) { bytes += part; }));
    return bytes;
  }
  int Count(const std::string& begin) {
    const auto requests = server_->Requests();
    return static_cast<int>(std::ranges::count_if(
        requests, [&](const std::string& request) { return request.starts_with(begin); }));
  }
  bool Put(const std::string& key, const std::string& bytes, S3Replace replace = S3Replace::kNo) {
    return client_->Put(
        key, Sha256Hex(bytes), static_cast<int64_t>(bytes.size()), BytesSource(bytes), replace);
  }
  static std::string Large() {
    std::string bytes;
    for (int i = 0; bytes.size() < (size_t{11} << 20); ++i) bytes += std::to_string(i) + " ";
    return bytes;
  }

  ScratchFolder scratch_;
  std::unique_ptr<S3Process> server_;
  std::unique_ptr<S3Client> client_;
};

TEST_F(S3ClientTest, WritesReadsAndRemoves) {
  EXPECT_TRUE(client_->PutBytes("a", "hello", S3Replace::kNo).has_value());
  EXPECT_FALSE(client_->PutBytes("a", "other", S3Replace::kNo).has_value()) << "it exists";
  EXPECT_EQ(client_->GetBytes("a"), "hello");
  EXPECT_TRUE(client_->PutBytes("a", "other", S3Replace::kYes).has_value());
  EXPECT_EQ(Get("a", 1, 3), "the");
  ASSERT_TRUE(client_->Head("a").has_value());
  EXPECT_EQ(client_->Head("a")->size_bytes, 5);
  EXPECT_FALSE(client_->Delete("a", "\"of another\""));
  EXPECT_TRUE(client_->Delete("a", client_->Head("a")->etag));
  EXPECT_TRUE(client_->Delete("a")) << "there is none";
  EXPECT_FALSE(client_->Head("a").has_value());
  EXPECT_FALSE(client_->GetBytes("a").has_value());
  EXPECT_FALSE(client_->Get("a", 0, 1, [](std::string_view) {}));
}

TEST_F(S3ClientTest, SignsKeysOfAnyCharacters) {
  for (const char* key : {"a b", "ä/ö", "x+y=z&q?#%25", "~tilde", "a//b", "../up"}) {
    EXPECT_TRUE(client_->PutBytes(key, key, S3Replace::kNo).has_value()) << key;
    EXPECT_EQ(client_->GetBytes(key), key);
  }
  int listed = 0;
  client_->List("", [&](const S3Object& object) {
    EXPECT_EQ(client_->GetBytes(object.key), object.key);
    return ++listed > 0;
  });
  EXPECT_EQ(listed, 6);
}

TEST_F(S3ClientTest, TemporaryKeysHaveATokenThatIsSigned) {
  server_->Set(R"({"token": "of/the+session="})");
  EXPECT_THAT(ProblemOf([&] { client_->Head("a"); }), HasSubstr("400"));
  S3Options options = server_->Options();
  options.key = [key = options.key()]() mutable {
    key.session_token = "of/the+session=";
    return key;
  };
  Connect(options);
  EXPECT_FALSE(client_->Head("a").has_value());
}

TEST_F(S3ClientTest, ListsInPages) {
  server_->Set(R"({"page": 3})");
  std::vector<std::string> expected;
  for (int i = 0; i < 10; ++i) {
    expected.push_back("in/" + std::to_string(i));
    client_->PutBytes(expected.back(), "x", S3Replace::kNo);
  }
  client_->PutBytes("other", "x", S3Replace::kNo);
  server_->Requests();
  std::vector<std::string> listed;
  client_->List("in/", [&](const S3Object& object) {
    listed.push_back(object.key);
    return true;
  });
  EXPECT_EQ(listed, expected);
  EXPECT_EQ(Count("GET "), 4);
  int seen = 0;
  client_->List("in/", [&](const S3Object&) { return ++seen < 2; });
  EXPECT_EQ(seen, 2);
  EXPECT_EQ(Count("GET "), 1) << "later pages are not asked for";
}

TEST_F(S3ClientTest, RepeatsWhatMayPass) {
  for (const char* fault : {kUnavailable,
                            R"("kind": "status", "status": 500, "code": "InternalError")",
                            R"("kind": "status", "status": 429)",
                            R"("kind": "status", "status": 504)",
                            R"("kind": "status", "status": 400, "code": "RequestTimeout")",
                            R"("kind": "drop")",
                            R"("kind": "lose")"}) {
    for (const auto& [begin, call] : std::vector<std::pair<std::string, std::function<bool()>>>{
             {"PUT ", [&] { return client_->PutBytes("k", "v", S3Replace::kYes).has_value(); }},
             {"GET k", [&] { return client_->GetBytes("k") == "v"; }},
             {"HEAD ", [&] { return client_->Head("k").has_value(); }},
             {"GET .*list-type",
              [&] {
                int count = 0;
                client_->List("", [&](const S3Object&) { return ++count > 0; });
                return count == 1;
              }},
             {"DELETE ", [&] { return client_->Delete("k"); }}}) {
      // Without its body, the answer to HEAD does not tell what was wrong.
      if (begin == "HEAD " && std::string(fault).find("400") != std::string::npos) continue;
      server_->Fail(begin, 3, fault);
      EXPECT_TRUE(call()) << begin << " with " << fault;
    }
  }
}

TEST_F(S3ClientTest, RepeatedWriteHasOneEffect) {
  server_->Fail("PUT ", 1, R"("kind": "lose")");
  EXPECT_FALSE(client_->PutBytes("k", "v", S3Replace::kNo).has_value())
      << "its first try has written the object";
  EXPECT_EQ(client_->GetBytes("k"), "v");
}

TEST_F(S3ClientTest, DoesNotRepeatRefusals) {
  for (const char* code : {"AccessDenied", "InvalidAccessKeyId", "SignatureDoesNotMatch"}) {
    server_->Fail(
        "", 1, R"("kind": "status", "status": 403, "code": ")" + std::string(code) + "\"");
    server_->Requests();
    EXPECT_THAT(ProblemOf([&] { client_->GetBytes("k"); }), HasSubstr(code));
    EXPECT_EQ(Count("GET "), 1) << code;
  }
  server_->Requests();
  EXPECT_FALSE(client_->GetBytes("k").has_value());
  EXPECT_EQ(Count("GET "), 1) << "404";
  server_->Set(R"({"bucket": "another"})");
  EXPECT_THAT(ProblemOf([&] { client_->GetBytes("k"); }), HasSubstr("NoSuchBucket"));
  EXPECT_THAT(ProblemOf([&] { client_->Get("k", 0, 5, [](std::string_view) {}); }),
              HasSubstr("create the bucket"));
}

TEST_F(S3ClientTest, GivesUpAfterItsTries) {
  S3Options options = server_->Options();
  options.timing.tries = 4;
  Connect(options);
  server_->Fail("", 1000, kUnavailable);
  server_->Requests();
  EXPECT_THAT(ProblemOf([&] { client_->GetBytes("k"); }), HasSubstr("503 SlowDown"));
  EXPECT_EQ(Count("GET "), 4);
}

TEST_F(S3ClientTest, WaitsAsLongAsTheStoreAsks) {
  server_->Fail("GET ", 1, std::string(kUnavailable) + R"(, "headers": {"Retry-After": "1"})");
  client_->PutBytes("k", "v", S3Replace::kNo);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(client_->GetBytes("k"), "v");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(1000));
}

TEST_F(S3ClientTest, ReadsGoOnWhereTheyBroke) {
  const std::string bytes = Large();
  Put("k", bytes);
  server_->Requests();
  server_->Fail("GET k", 3, R"("kind": "truncate")");
  EXPECT_TRUE(Get("k", 0, static_cast<int64_t>(bytes.size())) == bytes);
  EXPECT_EQ(Count("GET k"), 4);
  // Ranges of parts of it.
  server_->Fail("GET k", 1, R"("kind": "truncate")");
  EXPECT_EQ(Get("k", 1000, 5000), bytes.substr(1000, 5000));
}

TEST_F(S3ClientTest, SlowIsNotSilent) {
  client_->PutBytes("k", std::string(1000, 'x'), S3Replace::kNo);
  server_->Requests();
  server_->Fail("GET k", 1, R"("kind": "slow", "seconds": 3)");
  EXPECT_EQ(Get("k", 0, 1000), std::string(1000, 'x'));
  EXPECT_EQ(Count("GET k"), 1) << "bytes have come all the time";
  server_->Fail("GET k", 1, R"("kind": "stall", "seconds": 20)");
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(Get("k", 0, 1000), std::string(1000, 'x'));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(10));
  EXPECT_EQ(Count("GET k"), 2);
}

TEST_F(S3ClientTest, WritesLargeObjectsInParts) {
  const std::string bytes = Large();
  EXPECT_TRUE(Put("k", bytes));
  EXPECT_EQ(Count("PUT k?partNumber"), 3);
  EXPECT_TRUE(Get("k", 0, static_cast<int64_t>(bytes.size())) == bytes);
  EXPECT_FALSE(Put("k", bytes)) << "it exists";
  EXPECT_EQ(server_->UnfinishedUploads(), 0);
  EXPECT_TRUE(Put("k", bytes, S3Replace::kYes));
}

TEST_F(S3ClientTest, PartsSurviveFailures) {
  const std::string bytes = Large();
  const std::vector<std::pair<std::string, std::string>> faults{
      {"POST k.uploads", kUnavailable},
      {"PUT k.partNumber=2", kUnavailable},
      {"PUT k.partNumber=2", R"("kind": "lose")"},
      {"POST k.uploadId", kUnavailable},
      {"POST k.uploadId", R"("kind": "fail_within")"},
      {"POST k.uploadId", R"("kind": "lose")"}};
  for (const auto& [match, fault] : faults) {
    server_->Fail(match, 2, fault);
    EXPECT_TRUE(Put("k", bytes, S3Replace::kYes)) << match << fault;
    EXPECT_TRUE(Get("k", 0, static_cast<int64_t>(bytes.size())) == bytes) << match << fault;
    EXPECT_EQ(server_->UnfinishedUploads(), 0);
    client_->Delete("k");
  }
}

TEST_F(S3ClientTest, AbortsUploadThatFails) {
  const std::string bytes = Large();
  for (const char* match : {"PUT k.partNumber=3", "POST k.uploadId"}) {
    server_->Fail(match, 1, R"("kind": "status", "status": 403, "code": "AccessDenied")");
    EXPECT_THAT(ProblemOf([&] { Put("k", bytes); }), HasSubstr("AccessDenied"));
    EXPECT_EQ(server_->UnfinishedUploads(), 0);
    EXPECT_TRUE(server_->Keys().empty());
  }
}

TEST_F(S3ClientTest, StoresNoOtherBytes) {
  for (const std::string& bytes : {std::string("short"), Large()}) {
    try {
      client_->Put("k",
                   Sha256Hex("other"),
                   static_cast<int64_t>(bytes.size()),
                   BytesSource(bytes),
                   S3Replace::kNo);
      FAIL() << "the digest is wrong";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kDataLoss);
      EXPECT_THAT(e.what(), HasSubstr("do not have this digest"));
    }
    EXPECT_TRUE(server_->Keys().empty());
    EXPECT_EQ(server_->UnfinishedUploads(), 0);
  }
}

TEST_F(S3ClientTest, StopEndsCallsUnderWay) {
  client_->PutBytes("k", "v", S3Replace::kNo);
  server_->Fail("GET k", 1000, R"("kind": "late", "seconds": 20)");
  std::thread stop([&] {
    std::this_thread::sleep_for(milliseconds(300));
    client_->Stop();
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(ProblemOf([&] { client_->GetBytes("k"); }), HasSubstr("shutting down"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(5));
  stop.join();
  EXPECT_NE(ProblemOf([&] { client_->Head("k"); }), "");
}

TEST_F(S3ClientTest, ExceptionsOfReadersPassThrough) {
  client_->PutBytes("k", "v", S3Replace::kNo);
  server_->Requests();
  EXPECT_THROW(client_->Get("k", 0, 1, [](std::string_view) { throw std::out_of_range("disk"); }),
               std::out_of_range);
  EXPECT_EQ(Count("GET k"), 1);
  EXPECT_EQ(client_->GetBytes("k"), "v");
}

TEST(S3TargetTest, ParsesAddresses) {
  const S3Target amazon = ParseS3Target("s3://my.bucket-1", "", "eu-central-1");
  EXPECT_EQ(amazon.Endpoint(), "https://s3.eu-central-1.amazonaws.com");
  EXPECT_EQ(amazon.Name(), "s3://my.bucket-1");
  EXPECT_EQ(amazon.prefix, "");
  const S3Target own = ParseS3Target("s3://blobs/a/b/", "http://[::1]:9000/", "us-east-1");
  EXPECT_EQ(own.Endpoint(), "http://[::1]:9000");
  EXPECT_EQ(own.Name(), "s3://blobs/a/b");
  EXPECT_EQ(own.prefix, "a/b/");
  EXPECT_EQ(ParseS3Target("s3://blobs", "https://h:443", "r").host, "h");
  EXPECT_EQ(ParseS3Target("s3://blobs", "http://h:443", "r").host, "h:443");
  for (const auto& [blobs, endpoint, region, named] :
       std::vector<std::array<std::string, 4>>{{"blobs", "", "", "--blobs blobs"},
                                               {"s3://", "", "", "3 to 63"},
                                               {"s3://Upper", "", "", "3 to 63"},
                                               {"s3://abc/a//b", "", "", "single '/'"},
                                               {"s3://abc/../x", "", "", "single '/'"},
                                               {"s3://abc/a b", "", "", "single '/'"},
                                               {"s3://abc", "host:1", "", "--s3-endpoint host:1"},
                                               {"s3://abc", "http://h:0", "", "1 to 65535"},
                                               {"s3://abc", "http://h:x", "", "1 to 65535"},
                                               {"s3://abc", "http://h/path", "", "only a host"},
                                               {"s3://abc", "http://u@h", "", "only a host"},
                                               {"s3://abc", "", "EU", "--s3-region EU"}}) {
    try {
      ParseS3Target(blobs, endpoint, region);
      ADD_FAILURE() << blobs << endpoint << region;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
      EXPECT_THAT(e.what(), HasSubstr(named));
    }
  }
}

}  // namespace
}  // namespace color3d
