// Requests to one bucket: signed, tried again after failures that may pass, and verified.
// Thread-safe. All calls throw S3Error; those that write bytes take any number of tries to have one
// effect.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/storage/s3/http_pool.h"
#include "server/storage/s3/s3_error.h"
#include "server/storage/s3/s3_target.h"
#include "server/storage/s3/sigv4.h"

namespace color3d {

struct S3Timing {
  std::chrono::milliseconds connect{5'000};
  std::chrono::seconds stall{30};      // without a byte
  std::chrono::seconds assembly{600};  // until the store has put the parts of an object together
  int tries = 8;
  // Pauses between tries double, up to the maximum; of each a random half to whole is waited.
  std::chrono::milliseconds first_pause{200}, max_pause{8'000};
};

struct S3Options {
  S3Target target;
  std::function<S3Key()> key;  // called for each request; thread-safe
  S3Timing timing = {};
  // Larger objects are written in parts of this size. S3 requires at least 5 MiB.
  int64_t part_bytes = int64_t{32} << 20;
};

struct S3Object {
  std::string key;
  int64_t size_bytes = 0;
  std::string etag;      // changes with each write of other bytes
  std::string modified;  // as the store writes it
};

// Bytes that are sent, possibly several times. Copies at most `size` bytes from `offset`; returns
// their number, at least 1.
using S3Source = std::function<size_t(int64_t offset, char* buffer, size_t size)>;
S3Source BytesSource(std::string_view bytes);  // which must outlive it

// Whether an object that exists is replaced.
enum class S3Replace { kNo, kYes };

class S3Client {
 public:
  explicit S3Client(S3Options options);

  const S3Target& target() const { return options_.target; }
  // Ends the calls under way and all later ones, which throw.
  void Stop() { http_.Stop(); }
  bool Pause(std::chrono::milliseconds time) { return http_.Pause(time); }

  // All keys are without the prefix of the target.
  std::optional<S3Object> Head(const std::string& key);
  // Gives the bytes from `offset` to `sink`, continuing where a connection broke. Returns false if
  // there is no such object.
  bool Get(const std::string& key,
           int64_t offset,
           int64_t size_bytes,
           const std::function<void(std::string_view)>& sink);
  // Returns a small object.
  std::optional<std::string> GetBytes(const std::string& key);
  // Returns the ETag, or nothing if the object exists and is not to be replaced (stores that do not
  // know the condition replace it).
  std::optional<std::string> PutBytes(const std::string& key,
                                      std::string_view bytes,
                                      S3Replace replace);
  // Writes an object with this digest; throws Error{kDataLoss} and stores nothing if the source has
  // other bytes. Returns false if the object exists and is not to be replaced.
  bool Put(const std::string& key,
           const std::string& sha256,
           int64_t size_bytes,
           const S3Source& source,
           S3Replace replace);
  // Returns false if it was to be removed only with an ETag that it no longer has (stores that do
  // not know the condition remove it). Without an object: true.
  bool Delete(const std::string& key, const std::string& only_with_etag = "");
  // Visits the objects below `folder` in the order of their keys until `visit` returns false.
  void List(const std::string& folder, const std::function<bool(const S3Object&)>& visit);

  struct Upload {
    std::string key, id;
    std::string begun;  // time of the store, ISO 8601
  };
  // Uploads in parts below `folder` that were neither completed nor aborted.
  std::vector<Upload> ListUploads(const std::string& folder);
  void Abort(const Upload& upload);
  // Time of the store, by its last answer, s since 1970; 0: no answer yet.
  int64_t StoreTime() const { return store_time_; }

 private:
  struct Body {
    S3Source source;
    int64_t offset = 0, bytes = 0;
    std::string sha256;
  };
  struct Ask {
    S3Request request;
    std::string key;
    const Body* body = nullptr;
    std::function<void(std::string_view)> sink = {};
    std::chrono::seconds stall{0};   // 0: as usual
    std::vector<int> expected = {};  // statuses besides 2xx that are answers, not errors
    bool may_fail_within = false;    // a 200 may have an error as its body
  };
  HttpAnswer Once(const Ask& ask);
  // With retries; throws MakeS3Error.
  HttpAnswer Send(const Ask& ask);
  std::string NameOf(const Ask& ask) const;
  // Waits before try `done` + 1; returns false if there is none.
  bool PauseBefore(int done, const HttpAnswer& answer);
  S3Request RequestFor(const std::string& method, const std::string& key) const;
  bool PutWhole(const std::string& key, const Body& body, S3Replace replace, std::string* etag);
  bool PutParts(const std::string& key,
                const std::string& sha256,
                int64_t size_bytes,
                const S3Source& source,
                S3Replace replace);
  bool Complete(const Upload& upload,
                const std::vector<std::string>& etags,
                int64_t size_bytes,
                S3Replace replace);

  const S3Options options_;
  HttpPool http_;
  std::atomic<int64_t> store_time_{0};
};

}  // namespace color3d
