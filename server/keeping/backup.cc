#include "server/keeping/backup.h"

#include <sys/stat.h>
#include <unistd.h>

#include <optional>
#include <set>
#include <string>
#include <system_error>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "server/base/service_error.h"
#include "server/storage/data_folder.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_job_store.h"
#include "server/store/store_file.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

Error Refused(const fs::path& folder, const char* why) {
  return Error(ErrorCode::kFailedPrecondition, "{} {}", folder.string(), why);
}

bool IsEmptyOrNone(const fs::path& folder) {
  std::error_code error;
  return !fs::exists(folder, error) || fs::is_empty(folder, error);
}

enum class Copy { kWhole, kMissing, kDamaged };

// The digest of the copy verifies both reading and writing.
Copy CopyBlob(const fs::path& from, const std::string& sha256, const fs::path& part) {
  std::error_code error;
  fs::copy_file(from, part, fs::copy_options::overwrite_existing, error);
  if (error == std::errc::no_such_file_or_directory) return Copy::kMissing;
  if (error == std::errc::io_error) return Copy::kDamaged;
  if (::access(from.c_str(), R_OK) != 0) {
    throw ServiceError(
        ErrorReason::kBlobUnreadable, "cannot read {}: {}", from.string(), error.message());
  }
  if (error) {
    throw Error(ErrorCode::kUnavailable,
                "cannot copy the blob {} to {}: {}",
                sha256,
                part.parent_path().string(),
                error.message());
  }
  ::chmod(part.c_str(), 0600);
  return DigestFile(part).sha256 == sha256 ? Copy::kWhole : Copy::kDamaged;
}

enum class Kept { kGood, kDamaged, kNone };

// State of the blob in an earlier backup; damaged on read errors.
Kept CheckCopy(const BlobStore& copy, const std::string& sha256) {
  const std::optional<StoredBlob> blob = copy.Look(sha256);
  if (!blob) return Kept::kNone;
  return IsIntact(copy, blob->digest) ? Kept::kGood : Kept::kDamaged;
}

// Copies the blobs referenced by the copied store, which drops checkpoints that could not be
// copied.
CopiedBlobs CopyAll(const fs::path& copied_store, const DataPaths& from, const DataPaths& to) {
  SqliteJobStore store(copied_store, StoreRole::kTool, SystemClocks());
  const FileBlobStore source(from.Blobs());
  FileBlobStore target(to.Blobs());
  const fs::path part = to.root / ".blob.part";
  const std::set<std::string> awaited = store.AwaitedBlobs();
  CopiedBlobs result;
  for (const std::string& sha256 : store.ReferencedBlobs()) {
    const Kept kept = CheckCopy(target, sha256);
    if (kept == Kept::kGood) {
      ++result.kept;
      continue;
    }
    Copy copy = Copy::kMissing;
    try {
      if (source.Look(sha256)) copy = CopyBlob(source.Fetch(sha256), sha256, part);
    } catch (const Error& e) {
      if (!HasReason(e, ErrorReason::kBlobUnreadable)) throw;
      result.unreadable.push_back(sha256 + ": " + e.what());
      continue;
    }
    if (copy == Copy::kWhole) {
      const auto size = static_cast<int64_t>(fs::file_size(part));
      target.Adopt(part, {sha256, size});
      ++result.copied;
      result.mended += kept == Kept::kDamaged ? 1 : 0;
      result.bytes += size;
      continue;
    }
    // Prevents its use.
    if (kept == Kept::kDamaged) target.SetAside(sha256);
    DropCheckpoint(copied_store, sha256);
    if (!store.IsReferenced(sha256)) continue;
    if (copy == Copy::kMissing && awaited.contains(sha256)) {
      ++result.awaited;
      continue;
    }
    (copy == Copy::kMissing ? result.missing : result.damaged).push_back(sha256);
  }
  std::error_code error;
  fs::remove(part, error);
  return result;
}

// The store is published last, after all blobs that it names.
CopiedBlobs CopyWhole(const DataPaths& from, const DataPaths& to) {
  const fs::path part = to.root / "jobs.db.part";
  CopyStore(from.Store(), part);
  CopiedBlobs result;
  result.elsewhere = BlobPlaceOf(from);
  if (result.elsewhere.empty()) {
    result = CopyAll(part, from, to);
  } else {
    WriteFileAtomic(to.BlobPlace(), result.elsewhere + "\n");
  }
  // Reading the store has left an empty log beside it.
  std::error_code error;
  for (const char* log : {"-wal", "-shm"}) fs::remove(part.string() + log, error);
  PublishFile(part, to.Store());
  return result;
}

void MakePrivate(const fs::path& folder) {
  std::error_code error, unknown;
  if (!fs::create_directories(folder, error) && !fs::is_directory(folder, unknown)) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot create {}: {}; name another folder, or change its permissions",
                folder.string(),
                error.message());
  }
  ::chmod(folder.c_str(), 0700);
}

}  // namespace

CopiedBlobs BackUp(const fs::path& data_folder, const fs::path& target) {
  const DataPaths from(data_folder), to(target);
  RequireStore(from.Store());
  std::error_code error;
  if (!IsEmptyOrNone(target) && !fs::is_regular_file(to.Store(), error) &&
      !fs::is_directory(to.Blobs(), error)) {
    throw Refused(target, "is neither empty nor a backup; name another folder");
  }
  MakePrivate(target);
  return CopyWhole(from, to);
}

CopiedBlobs Restore(const fs::path& backup, const fs::path& data_folder) {
  const DataPaths from(backup), to(data_folder);
  RequireStore(from.Store());
  if (!IsEmptyOrNone(data_folder)) {
    throw Refused(data_folder, "is not empty; move it away, or restore to another folder");
  }
  MakePrivate(data_folder);
  return CopyWhole(from, to);
}

}  // namespace color3d
