// Fuzz target: names, page tokens and digests of requests, and the file of access tokens.
#include <string_view>

#include "server/access/tokens.h"
#include "server/rpc/blobs/blob_service.h"
#include "server/rpc/calls/convert.h"
#include "tests/fuzz/request_checks.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  const std::string text(reinterpret_cast<const char*>(data), size);
  AnswerOrRefuse([&] {
    const UploadName name = ParseUploadName(text);
    if (!IsSha256Hex(name.digest.sha256)) std::abort();
  });
  AnswerOrRefuse([&] {
    const FileDigest digest = ParseBlobName(text);
    if (!IsSha256Hex(digest.sha256) || digest.size_bytes < 0) std::abort();
  });
  AnswerOrRefuse([&] {
    if (ParsePageToken(text, "jobs") < 0) std::abort();
  });
  AnswerOrRefuse([&] {
    CheckName(text, "jobs");
    if (!text.starts_with("jobs/") || text.find("..") != std::string::npos) std::abort();
  });
  AnswerOrRefuse([&] { CheckRequestId(text); });
  return AnswerOrRefuse([&] {
    for (const TokenRecord& record : ParseTokens(text, "tokens")) {
      if (record.name.empty() || !IsSha256Hex(record.sha256)) std::abort();
    }
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  const std::string digest = Sha256Hex("x");
  return {"uploads/3f0c9a52-7e4b-4c1d-9b1e-2f6d8a7c5b40/blobs/" + digest + "/12",
          "blobs/" + digest + "/12",
          "jobs/0123456789abcdef",
          MakePageToken(17, "jobs"),
          MakePageToken(17, "scenes"),
          "3f0c9a52-7e4b-4c1d-9b1e-2f6d8a7c5b40",
          "# who\nanna submit " + digest + "\nbert read " + digest + "\n"};
}

}  // namespace color3d
