// Writes of S3Client: whole objects, and large ones in parts.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <vector>

#include "core/base/digest.h"
#include "server/storage/s3/s3_client.h"
#include "server/storage/s3/s3_xml.h"

namespace color3d {
namespace {

// S3 takes no more.
constexpr int64_t kMaxParts = 10'000;

Error OtherBytes(const std::string& sha256) {
  return Error(ErrorCode::kDataLoss,
               "the bytes that were read for the blob {} do not have this digest; check the disk",
               sha256);
}

bool IsOtherBytes(const S3Error& error) {
  return error.s3_code() == "XAmzContentSHA256Mismatch" || error.s3_code() == "BadDigest";
}

// Reads a part of the source; returns its digest and adds its bytes to that of the whole.
std::string DigestOfPart(const S3Source& source, int64_t offset, int64_t bytes, Sha256* whole) {
  Sha256 part;
  std::vector<char> buffer(1 << 18);
  while (bytes > 0) {
    const size_t got = source(
        offset, buffer.data(), static_cast<size_t>(std::min<int64_t>(bytes, int64_t{1} << 18)));
    part.Update({buffer.data(), got});
    whole->Update({buffer.data(), got});
    offset += static_cast<int64_t>(got);
    bytes -= static_cast<int64_t>(got);
  }
  return part.FinishHex();
}

}  // namespace

bool S3Client::PutWhole(const std::string& key,
                        const Body& body,
                        S3Replace replace,
                        std::string* etag) {
  Ask ask{RequestFor("PUT", key), key, &body};
  if (replace == S3Replace::kNo) {
    ask.request.headers["if-none-match"] = "*";
    ask.expected = {412, 501};
  }
  HttpAnswer answer = Send(ask);
  if (answer.status == 412) return false;
  if (answer.status == 501) {  // the store does not know the condition
    ask.request.headers.erase("if-none-match");
    ask.expected.clear();
    answer = Send(ask);
  }
  if (etag != nullptr) *etag = answer.Header("etag");
  return true;
}

std::optional<std::string> S3Client::PutBytes(const std::string& key,
                                              std::string_view bytes,
                                              S3Replace replace) {
  const Body body{BytesSource(bytes), 0, static_cast<int64_t>(bytes.size()), Sha256Hex(bytes)};
  std::string etag;
  if (!PutWhole(key, body, replace, &etag)) return std::nullopt;
  return etag;
}

bool S3Client::Put(const std::string& key,
                   const std::string& sha256,
                   int64_t size_bytes,
                   const S3Source& source,
                   S3Replace replace) {
  try {
    if (size_bytes > 2 * options_.part_bytes) {
      return PutParts(key, sha256, size_bytes, source, replace);
    }
    return PutWhole(key, {source, 0, size_bytes, sha256}, replace, nullptr);
  } catch (const S3Error& e) {
    if (IsOtherBytes(e)) throw OtherBytes(sha256);
    throw;
  }
}

bool S3Client::PutParts(const std::string& key,
                        const std::string& sha256,
                        int64_t size_bytes,
                        const S3Source& source,
                        S3Replace replace) {
  Ask begin{RequestFor("POST", key), key};
  begin.request.query = {{"uploads", ""}};
  const Body empty{BytesSource(""), 0, 0, Sha256Hex("")};
  begin.body = &empty;
  const Upload upload{key, XmlText(Send(begin).text, "UploadId"), ""};
  if (upload.id.empty()) {
    throw S3Error(NameOf(begin) + ": the store gave no id of an upload; see its log", 200, "");
  }
  try {
    const int64_t part_bytes =
        std::max(options_.part_bytes, (size_bytes + kMaxParts - 1) / kMaxParts);
    Sha256 whole;
    std::vector<std::string> etags;
    for (int64_t offset = 0; offset < size_bytes; offset += part_bytes) {
      Body part{source, offset, std::min(part_bytes, size_bytes - offset), ""};
      part.sha256 = DigestOfPart(source, offset, part.bytes, &whole);
      Ask ask{RequestFor("PUT", key), key, &part};
      ask.request.query = {{"partNumber", std::to_string(etags.size() + 1)},
                           {"uploadId", upload.id}};
      etags.push_back(Send(ask).Header("etag"));
    }
    if (whole.FinishHex() != sha256) throw OtherBytes(sha256);
    if (Complete(upload, etags, size_bytes, replace)) return true;
    Abort(upload);
    return false;
  } catch (const Error&) {
    try {
      Abort(upload);
    } catch (const Error& e) {
      spdlog::warn("the parts of an upload are left in the store until a sweep: {}", e.what());
    }
    throw;
  }
}

bool S3Client::Complete(const Upload& upload,
                        const std::vector<std::string>& etags,
                        int64_t size_bytes,
                        S3Replace replace) {
  std::string list = "<CompleteMultipartUpload xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">";
  for (size_t i = 0; i < etags.size(); ++i) {
    list += fmt::format(
        "<Part><PartNumber>{}</PartNumber><ETag>{}</ETag></Part>", i + 1, XmlEscape(etags[i]));
  }
  list += "</CompleteMultipartUpload>";
  const Body body{BytesSource(list), 0, static_cast<int64_t>(list.size()), Sha256Hex(list)};
  Ask ask{RequestFor("POST", upload.key), upload.key, &body};
  ask.request.query = {{"uploadId", upload.id}};
  ask.stall = options_.timing.assembly;
  ask.may_fail_within = true;
  ask.expected = {404, 412, 501};
  if (replace == S3Replace::kNo) ask.request.headers["if-none-match"] = "*";
  HttpAnswer answer = Send(ask);
  if (answer.status == 501) {
    ask.request.headers.erase("if-none-match");
    answer = Send(ask);
  }
  if (answer.status == 412) return false;
  if (answer.status == 404) {
    // An earlier try has completed the upload and its answer was lost.
    const std::optional<S3Object> stored = Head(upload.key);
    if (!stored || stored->size_bytes != size_bytes) {
      throw MakeS3Error(options_.target, NameOf(ask), answer);
    }
  }
  return true;
}

}  // namespace color3d
