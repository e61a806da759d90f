// Resumable uploads into the blob store: uploads/<uuid>[@project].<sha256>.<size>.part grows until
// it is whole; the digest is then verified and the file becomes a blob. Thread-safe.
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
  std::string owner = {};  // project: uploads of others are not gone on with
};

class UploadStore {
 public:
  UploadStore(const std::filesystem::path& folder, BlobStore& blobs, int64_t max_blob_bytes);

  // Bytes of an unfinished upload that survive a crash (synced before they are reported); 0 for one
  // that is unknown or has become a blob.
  int64_t CommittedSize(const UploadName& name);

  // One open write. A second Open of the same upload takes it over: the client has reconnected, and
  // the older writer gets Error{kAborted}.
  class Writer {
   public:
    ~Writer();
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
    // `offset` must be where the last write ended. kInvalidArgument otherwise or beyond the
    // announced size; kResourceExhausted (STORAGE_FULL) when the disk is full.
    void Append(int64_t offset, std::string_view data);
    // Verifies and stores the blob. kInvalidArgument DIGEST_MISMATCH drops the upload.
    void Finish();
    // Syncs what has been written; returns its length.
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
    SpaceReservation space_;  // for what is still to come
  };
  // Throws to refuse an upload after which the unfinished uploads of its owner would take
  // `owner_bytes`. Called for one upload at a time.
  using Admission = std::function<void(int64_t owner_bytes)>;
  // `offset` must be the committed size (kInvalidArgument, OFFSET_MISMATCH). An owner may have
  // 1,000 unfinished uploads (kResourceExhausted, QUOTA_EXCEEDED). A blob that is there need not be
  // written again.
  std::unique_ptr<Writer> Open(
      const UploadName& name, int64_t offset, const Admission& admit = [](int64_t) {});

  struct Reaped {
    int uploads = 0;
    std::vector<std::string> unreadable;  // as WalkFolder
  };
  // Removes uploads that are not being written and that have not grown for `age`, at this call and
  // at the last one.
  Reaped ReapOlderThan(std::chrono::seconds age);

 private:
  std::filesystem::path PartPath(const UploadName& name) const;
  // Counts the bytes on disk of an upload that is not being written.
  void CountOnDisk(const std::string& part) COLOR3D_REQUIRES(mutex_);

  std::filesystem::path folder_;
  BlobStore& blobs_;
  int64_t max_blob_bytes_;
  StaleFiles stale_;
  Mutex mutex_;
  std::map<std::string, std::weak_ptr<Writer::Session>> sessions_ COLOR3D_GUARDED_BY(mutex_);
  // By owner and file: what is announced of uploads that are being written, else what is there.
  std::map<std::string, std::map<std::string, int64_t>> bytes_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
