#include "server/storage/s3/sigv4.h"

#include <gtest/gtest.h>

#include "core/base/digest.h"

namespace color3d {
namespace {

// The examples of "Authenticating Requests: Using the Authorization Header" in Amazon's reference
// of the API of S3, with the signatures that it documents.
const S3Key kExampleKey{"AKIAIOSFODNN7EXAMPLE", "wJalrXUtnFEMI/K7MDENG/bPxRfiCYEXAMPLEKEY"};
constexpr char kExampleTime[] = "20130524T000000Z";

S3Request ExampleRequest() {
  S3Request request;
  request.payload_sha256 = Sha256Hex("");
  request.headers = {{"host", "examplebucket.s3.amazonaws.com"},
                     {"x-amz-content-sha256", request.payload_sha256},
                     {"x-amz-date", kExampleTime}};
  return request;
}

std::string SignatureOf(const S3Request& request) {
  const std::string header = S3Authorization(request, kExampleKey, "us-east-1", kExampleTime);
  return header.substr(header.rfind('=') + 1);
}

TEST(SigV4Test, SignsGetOfRangeAsDocumented) {
  S3Request request = ExampleRequest();
  request.path = "/test.txt";
  request.headers["range"] = "bytes=0-9";
  EXPECT_EQ(S3Authorization(request, kExampleKey, "us-east-1", kExampleTime),
            "AWS4-HMAC-SHA256 "
            "Credential=AKIAIOSFODNN7EXAMPLE/20130524/us-east-1/s3/aws4_request,"
            "SignedHeaders=host;range;x-amz-content-sha256;x-amz-date,"
            "Signature=f0e8bdb87c964420e857bd35b5d6ed310bd44f0170aba48dd91039c6036bdb41");
}

TEST(SigV4Test, SignsPutAsDocumented) {
  S3Request request = ExampleRequest();
  request.method = "PUT";
  request.path = "/test$file.text";
  request.payload_sha256 = Sha256Hex("Welcome to Amazon S3.");
  request.headers["x-amz-content-sha256"] = request.payload_sha256;
  request.headers["date"] = "Fri, 24 May 2013 00:00:00 GMT";
  request.headers["x-amz-storage-class"] = "REDUCED_REDUNDANCY";
  EXPECT_EQ(SignatureOf(request),
            "98ad721746da40c64f1a55b78f14c238d841ea1380cd77a1b5971af0ece108bd");
}

TEST(SigV4Test, SignsQueriesAsDocumented) {
  S3Request request = ExampleRequest();
  request.query = {{"lifecycle", ""}};
  EXPECT_EQ(SignatureOf(request),
            "fea454ca298b7da1c68078a5d1bdbfbbe0d65c699e0f91ac7a200a0136783543");
  request.query = {{"prefix", "J"}, {"max-keys", "2"}};
  EXPECT_EQ(SignatureOf(request),
            "34b48302e7b5fa45bde8084f4b7868a86f0a534bc59db6670ed5711ef69dc6f7");
}

TEST(SigV4Test, EncodesPathsAndTimes) {
  EXPECT_EQ(UriEncode("a b/ä~+=", true), "a%20b/%C3%A4~%2B%3D");
  EXPECT_EQ(UriEncode("a/b", false), "a%2Fb");
  EXPECT_EQ(S3Time(std::chrono::system_clock::from_time_t(1369353600)), kExampleTime);
}

}  // namespace
}  // namespace color3d
