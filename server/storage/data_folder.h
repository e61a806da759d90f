// Layout of the data folder, and the lock that excludes a second server.
#pragma once

#include <filesystem>
#include <string>

namespace color3d {

struct DataPaths {
  explicit DataPaths(const std::filesystem::path& data_folder) : root(data_folder) {}
  std::filesystem::path root;
  std::filesystem::path Store() const { return root / "jobs.db"; }
  std::filesystem::path Blobs() const { return root / "blobs"; }
  std::filesystem::path Uploads() const { return root / "uploads"; }
  std::filesystem::path Scratch() const { return root / "scratch"; }
  // May be deleted at any time.
  std::filesystem::path Cache() const { return root / "cache"; }
  std::filesystem::path Logs() const { return root / "logs"; }
  // Logs of single jobs, "<job id>.log".
  std::filesystem::path JobLogs() const { return Logs() / "jobs"; }
  // Blobs of an object store, only for the server; may be deleted while it does not run.
  std::filesystem::path BlobCache() const { return root / "blob-cache"; }
  // Names the object store with the blobs; no file: they are in Blobs().
  std::filesystem::path BlobPlace() const { return root / "blob-place"; }
  // Private sockets between the server and its workers.
  std::filesystem::path Sockets() const { return root / "sockets"; }
  // Released when the disk is full.
  std::filesystem::path BallastFile() const { return root / "ballast"; }
  std::filesystem::path Lock() const { return root / "lock"; }
};

// Returns the name of the object store with the blobs of the folder, "s3://..."; empty: blobs/.
std::string BlobPlaceOf(const DataPaths& paths);

// Creates the folders. Throws Error{kFailedPrecondition} if that fails or the folder is not
// writable.
void PrepareDataFolder(const DataPaths& paths);

// Lock of a server on its data folder; released by the destructor or the end of the process.
class DataFolderLock {
 public:
  // Throws Error{kFailedPrecondition} if another process holds it.
  explicit DataFolderLock(const DataPaths& paths);
  ~DataFolderLock();
  DataFolderLock(const DataFolderLock&) = delete;
  DataFolderLock& operator=(const DataFolderLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace color3d
