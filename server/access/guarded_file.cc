#include "server/access/guarded_file.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr auto kLook = std::chrono::seconds(1);

// Identity of the file's contents and permissions, from its metadata.
std::string FileIdentity(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return "";
  return fmt::format("{} {} {} {} {}",
                     status.st_ino,
                     status.st_size,
                     status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec,
                     status.st_mode);
}

}  // namespace

GuardedFile::GuardedFile(const fs::path& file,
                         const char* what,
                         std::function<void(const std::string&)> take)
    : file_(file), what_(what), take_(std::move(take)), identity_(FileIdentity(file)) {
  take_(Read());
}

std::string GuardedFile::Read() const {
  struct stat status {};
  if (::stat(file_.c_str(), &status) == 0 && (status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    throw Error(
        ErrorCode::kFailedPrecondition,
        "the {} {} is writable by others, who could grant themselves access; run chmod 600 {}",
        what_,
        file_.string(),
        file_.string());
  }
  return ReadFile(file_);
}

void GuardedFile::Reload() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_look_) return;
  next_look_ = now + kLook;
  const std::string identity = FileIdentity(file_);
  if (identity == identity_) return;
  identity_ = identity;
  try {
    take_(Read());
    spdlog::info("reloaded {}", file_.string());
  } catch (const Error& e) {
    spdlog::error("cannot reload the {}, keeping its previous contents: {}", what_, e.what());
  }
}

void GuardedFile::WithLatest(const std::function<void()>& use) {
  const MutexLock lock(mutex_);
  Reload();
  use();
}

}  // namespace color3d
