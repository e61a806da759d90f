#include "core/base/files.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/base/error.h"
#include "core/base/file_descriptor.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void ThrowErrno(const std::string& what, const fs::path& path) {
  const int error = errno;
  ErrorCode code = ErrorCode::kInternal;
  std::string remedy;
  if (error == ENOSPC || error == EDQUOT) {
    code = ErrorCode::kResourceExhausted;
    remedy = "; free some disk space";
  } else if (error == EACCES || error == EPERM || error == EROFS) {
    code = ErrorCode::kFailedPrecondition;
    remedy = "; check the permissions";
  } else if (error == ENOENT || error == ENOTDIR) {
    code = ErrorCode::kNotFound;
  }
  throw Error(code, "{} {}: {}{}", what, path.string(), std::strerror(error), remedy);
}

// Gives the new file the mode and owner of the file that it replaces. Without permission to change
// the owner, keeps the mode only.
void CopyModeAndOwner(int fd, const fs::path& replaced) {
  struct stat before {
  }, now{};
  if (::stat(replaced.c_str(), &before) != 0 || !S_ISREG(before.st_mode)) return;
  if (::fstat(fd, &now) != 0) return;
  if (before.st_uid != now.st_uid || before.st_gid != now.st_gid) {
    // Separate calls: the group can often be kept where the owner cannot.
    [[maybe_unused]] const int group = ::fchown(fd, static_cast<uid_t>(-1), before.st_gid);
    [[maybe_unused]] const int owner = ::fchown(fd, before.st_uid, static_cast<gid_t>(-1));
  }
  if (::fchmod(fd, before.st_mode & 0777) != 0) ThrowErrno("cannot set the rights of", replaced);
}

}  // namespace

void SyncFolder(const fs::path& folder) {
  FileDescriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() >= 0) ::fsync(fd.get());
}

FolderTurn::FolderTurn(const fs::path& folder)
    : fd_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (fd_ < 0) ThrowErrno("cannot open the folder", folder);
  while (::flock(fd_, LOCK_EX) != 0) {
    if (errno == EINTR) continue;
    const int error = errno;
    ::close(fd_);
    errno = error;
    ThrowErrno("cannot lock the folder", folder);
  }
}

FolderTurn::~FolderTurn() { ::close(fd_); }

std::string ReadFile(const fs::path& path, int64_t max_bytes) {
  FileDescriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0) ThrowErrno("cannot open", path);
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) ThrowErrno("cannot read", path);
  if (S_ISDIR(status.st_mode)) throw InvalidArgument("{} is a folder, not a file", path.string());
  if (status.st_size > max_bytes) {
    throw Error(ErrorCode::kResourceExhausted,
                "{} has {} bytes, more than the {} allowed here",
                path.string(),
                status.st_size,
                max_bytes);
  }
  std::string bytes(static_cast<size_t>(status.st_size), '\0');
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(fd.get(), bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) ThrowErrno("cannot read", path);
    if (got == 0) break;
    done += static_cast<size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

void PublishFile(const fs::path& temporary, const fs::path& final_path) {
  {
    FileDescriptor fd(::open(temporary.c_str(), O_RDONLY | O_CLOEXEC));
    if (fd.get() < 0 || ::fsync(fd.get()) != 0) ThrowErrno("cannot sync", temporary);
  }
  if (::rename(temporary.c_str(), final_path.c_str()) != 0) ThrowErrno("cannot write", final_path);
  SyncFolder(final_path.parent_path());
}

void WriteFileAtomic(const fs::path& path, std::string_view bytes) {
  static std::atomic<uint64_t> counter{0};
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const fs::path temporary =
      folder /
      fmt::format(".{}.{}.{}.part", path.filename().string(), ::getpid(), counter.fetch_add(1));
  try {
    {
      // Never writes to an existing file or link.
      ::unlink(temporary.c_str());
      FileDescriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
      if (fd.get() < 0) ThrowErrno("cannot create", temporary);
      CopyModeAndOwner(fd.get(), path);
      size_t done = 0;
      while (done < bytes.size()) {
        const ssize_t put = ::write(fd.get(), bytes.data() + done, bytes.size() - done);
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) ThrowErrno("cannot write", path);
        done += static_cast<size_t>(put);
      }
    }
    PublishFile(temporary, fs::path(folder) / path.filename());
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
}

std::vector<std::string> ListFiles(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw Error(ErrorCode::kNotFound, "{} is not a folder", folder.string());
  }
  std::vector<std::string> files;
  fs::path reached = folder;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    std::error_code unknown;
    const std::string name = it->path().filename().string();
    if (!name.empty() && name[0] == '.') {
      if (it->is_directory(unknown)) it.disable_recursion_pending();
      continue;
    }
    if (it->is_regular_file(unknown)) {
      files.push_back(it->path().lexically_relative(folder).generic_string());
    }
    reached = it->path();
  }
  if (error) {
    throw Error(
        ErrorCode::kFailedPrecondition,
        "cannot read the folder {} (at {}): {}; make what is in it readable, or move it away",
        folder.string(),
        reached.string(),
        error.message());
  }
  std::sort(files.begin(), files.end());
  return files;
}

bool IsSafeRelativePath(std::string_view path) {
  if (path.empty() || path.size() > 1024 || path.front() == '/') return false;
  size_t start = 0;
  while (start <= path.size()) {
    size_t end = path.find('/', start);
    if (end == std::string_view::npos) end = path.size();
    const std::string_view part = path.substr(start, end - start);
    if (part.empty() || part == "." || part == ".." || part.size() > 255) return false;
    for (char c : part) {
      if (static_cast<unsigned char>(c) < 32 || c == '\\' || c == 127) return false;
    }
    start = end + 1;
  }
  return true;
}

ScratchFolder::ScratchFolder(const fs::path& parent) {
  std::error_code error;
  fs::create_directories(parent, error);
  std::string pattern = (parent / "color3d-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) ThrowErrno("cannot create a folder in", parent);
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

}  // namespace color3d
