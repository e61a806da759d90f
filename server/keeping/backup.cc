#include "server/keeping/backup.h"

#include <sys/stat.h>

#include <set>
#include <string>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"
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

std::set<std::string> NamedBlobs(const fs::path& store) {
  return SqliteJobStore(store, StoreRole::kWorker, SystemClocks()).ReferencedBlobs();
}

// The digest is taken of the copy, so that what was read and what was written are both checked.
void CopyBlob(const BlobStore& from,
              const std::string& sha256,
              const fs::path& part,
              BlobStore& to) {
  fs::copy_file(from.Fetch(sha256), part, fs::copy_options::overwrite_existing);
  ::chmod(part.c_str(), 0600);
  const FileDigest digest = DigestFile(part);
  if (digest.sha256 != sha256) {
    throw Error(ErrorCode::kDataLoss,
                "the blob {} is damaged; color3d-server fsck says what names it",
                sha256);
  }
  to.Adopt(part, digest);
}

bool IsThere(const BlobStore& blobs, const std::string& sha256) {
  try {
    blobs.Fetch(sha256);
    return true;
  } catch (const Error&) {
    return false;
  }
}

CopiedBlobs CopyAll(const std::set<std::string>& named,
                    const DataPaths& from,
                    const DataPaths& to) {
  const FileBlobStore source(from.Blobs());
  FileBlobStore target(to.Blobs());
  CopiedBlobs result;
  for (const std::string& sha256 : named) {
    if (IsThere(target, sha256)) {
      ++result.kept;
      continue;
    }
    if (!IsThere(source, sha256)) {
      throw Error(ErrorCode::kDataLoss, "{} lacks the blob {}", from.root.string(), sha256);
    }
    CopyBlob(source, sha256, to.root / ".blob.part", target);
    ++result.copied;
    result.bytes += static_cast<int64_t>(fs::file_size(target.Fetch(sha256)));
  }
  return result;
}

// The store last: what is named is there when its names are.
CopiedBlobs CopyWhole(const DataPaths& from, const DataPaths& to) {
  const fs::path part = to.root / "jobs.db.part";
  CopyStore(from.Store(), part);
  const CopiedBlobs result = CopyAll(NamedBlobs(part), from, to);
  // Looking into it has left a log beside it, which is empty.
  std::error_code error;
  for (const char* log : {"-wal", "-shm"}) fs::remove(part.string() + log, error);
  PublishFile(part, to.Store());
  return result;
}

void MakePrivate(const fs::path& folder) {
  std::error_code error, unknown;
  if (!fs::create_directories(folder, error) && !fs::is_directory(folder, unknown)) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot create {}: {}; name another folder, or change who may write there",
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
