// Resumable uploads into the blob store: uploads/<uuid>[@project].<sha256>.<size>.part grows until
// it is complete; then its digest is verified and the file becomes a blob. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/digest.h"
#include "core/base/mutex.h"
#include "server/storage/blob_store.h"
#include "server/storage/stale_files.h"

namespace color3d {

struct UploadName {
  std::string uuid;  // chosen by the client: letters, digits, '-', 1 to 64 of them
  FileDigest digest;
  std::string owner = {};  // project: only its own uploads can be resumed
};

class UploadStore {
 public:
  UploadStore(const std::filesystem::path& folder, BlobStore& blobs, int64_t max_blob_bytes);

  // Returns the synced bytes of an unfinished upload, which survive a crash; 0 if it is unknown or
  // complete.
  int64_t CommittedSize(const UploadName& name);

  // An open write. A second Open of the same upload (a reconnected client) takes it over; the older
  // writer then throws Error{kAborted}.
  class Writer {
   public:
    ~Writer();
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
    // Requires: `offset` is the end of the last write. Throws kInvalidArgument otherwise or beyond
    // the announced size, kResourceExhausted (STORAGE_FULL) if the disk is full.
    void Append(int64_t offset, std::string_view data);
    // Verifies and stores the blob. Throws kInvalidArgument (DIGEST_MISMATCH) and drops the upload
    // if the digest is wrong.
    void Finish();
    // Syncs the written bytes; returns their number.
    int64_t Sync();

   private:
    friend class UploadStore;
    struct Session;
    Writer() = default;
    UploadStore* store_ = nullptr;
    UploadName name_;
    std::shared_ptr<Session> session_;
    uint64_t generation_ = 0;
    int fd_ = -1;
    int64_t size_ = 0;
    SpaceReservation space_;  // for the missing bytes
  };
  // Throws to refuse an upload. `owner_bytes`: size of all unfinished uploads of its owner
  // including this one. Not called concurrently.
  using Admission = std::function<void(int64_t owner_bytes)>;
  // Requires: `offset` is the committed size (else kInvalidArgument, OFFSET_MISMATCH). Limits an
  // owner to 1,000 unfinished uploads (kResourceExhausted, QUOTA_EXCEEDED). A stored blob need not
  // be written again.
  std::unique_ptr<Writer> Open(
      const UploadName& name, int64_t offset, const Admission& admit = [](int64_t) {});

  struct Reaped {
    int uploads = 0;
    std::vector<std::string> unreadable;  // see WalkFolder
  };
  // Removes uploads that are not being written and had not grown for `age` at this and the last
  // call.
  Reaped ReapOlderThan(std::chrono::seconds age);

 private:
  std::filesystem::path PartPath(const UploadName& name) const;
  // Adds the bytes on disk of an upload that is not being written.
  void CountOnDisk(const std::string& part) COLOR3D_REQUIRES(mutex_);

  std::filesystem::path folder_;
  BlobStore& blobs_;
  int64_t max_blob_bytes_;
  StaleFiles stale_;
  Mutex mutex_;
  std::map<std::string, std::weak_ptr<Writer::Session>> sessions_ COLOR3D_GUARDED_BY(mutex_);
  // By owner and file: announced size of uploads that are being written, else size on disk.
  std::map<std::string, std::map<std::string, int64_t>> bytes_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
