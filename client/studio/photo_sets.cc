#include "client/studio/photo_sets.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/lib/names.h"
#include "client/lib/out_folder.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/text/utf8.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr char kFacts[] = "set.json";
constexpr size_t kMaxNameBytes = 200;

bool IsId(const std::string& id) {
  return !id.empty() && id.size() <= 64 && std::ranges::all_of(id, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || c == '-';
  });
}

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error) return;
  throw Error(error == std::errc::no_space_on_device ? ErrorCode::kResourceExhausted
                                                     : ErrorCode::kFailedPrecondition,
              "cannot create {}: {}; free space or set XDG_DATA_HOME to another folder",
              folder.string(),
              error.message());
}

// A file that is removed unless it is kept.
class PartFile {
 public:
  explicit PartFile(fs::path path)
      : path_(std::move(path)),
        fd_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600)) {
    if (fd_ < 0) Throw();
  }
  ~PartFile() {
    if (fd_ >= 0) ::close(fd_);
    std::error_code none;
    fs::remove(path_, none);
  }
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  void Append(const char* bytes, size_t count) {
    while (count > 0) {
      const ssize_t written = ::write(fd_, bytes, count);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) Throw();
      bytes += written;
      count -= static_cast<size_t>(written);
    }
  }
  void Keep(const fs::path& name) {
    ::close(std::exchange(fd_, -1));
    PublishFile(path_, name);
  }

 private:
  [[noreturn]] void Throw() const {
    throw Error(errno == ENOSPC || errno == EDQUOT ? ErrorCode::kResourceExhausted
                                                   : ErrorCode::kFailedPrecondition,
                "cannot write {}: {}; free space or set XDG_DATA_HOME to another folder",
                path_.string(),
                std::strerror(errno));
  }
  const fs::path path_;
  int fd_;
};

PhotoSet Read(const fs::path& folder) {
  const auto json = nlohmann::json::parse(
      ReadFile(folder / kFacts, 1 << 20), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) {
    throw Error(
        ErrorCode::kDataLoss, "{} is damaged; remove its folder", (folder / kFacts).string());
  }
  PhotoSet set;
  set.id = folder.filename();
  set.name = json.value("name", "");
  set.folder = json.value("folder", "");
  set.scene = json.value("scene", "");
  set.created_s = json.value("created_s", int64_t{0});
  set.is_own = json.value("is_own", false);
  set.as_frames = json.value("as_frames", false);
  return set;
}

}  // namespace

void PhotoSets::Write(const PhotoSet& set) const {
  const nlohmann::ordered_json json = {{"name", set.name},
                                       {"folder", set.folder.string()},
                                       {"scene", set.scene},
                                       {"created_s", set.created_s},
                                       {"is_own", set.is_own},
                                       {"as_frames", set.as_frames}};
  WriteFileAtomic(root_ / set.id / kFacts,
                  json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

PhotoSet PhotoSets::Create(const std::string& name) {
  PhotoSet set;
  set.id = NewUuid();
  set.name = CleanUtf8(name.empty() ? "Photos" : name, kMaxNameBytes);
  // The last part of the path names the scene.
  std::string part = set.name;
  std::ranges::replace(part, '/', '_');
  if (!IsSafeRelativePath(part) || part.starts_with('.')) part = "photos";
  set.folder = root_ / set.id / "files" / part;
  set.created_s = std::time(nullptr);
  set.is_own = true;
  MakeFolder(set.folder);
  const MutexLock lock(mutex_);
  Write(set);
  return set;
}

PhotoSet PhotoSets::Adopt(const fs::path& path) {
  std::error_code error;
  const fs::path canonical = fs::canonical(path, error);
  if (error) {
    throw Error(ErrorCode::kNotFound,
                "there is no folder of photos or film {}; check the path",
                path.string());
  }
  PhotoSet set;
  set.id = Sha256Hex(canonical.string()).substr(0, 32);
  const MutexLock lock(mutex_);
  if (fs::exists(root_ / set.id / kFacts, error)) {
    set = Read(root_ / set.id);
  } else {
    set.name = CleanUtf8(canonical.filename().string(), kMaxNameBytes);
    set.folder = canonical;
    MakeFolder(root_ / set.id);
  }
  set.created_s = std::time(nullptr);
  Write(set);
  return set;
}

PhotoSet PhotoSets::Get(const std::string& id) const {
  std::error_code none;
  if (!IsId(id) || !fs::exists(root_ / id / kFacts, none)) {
    throw Error(
        ErrorCode::kNotFound, "there are no photos {}; reload the page", EscapeControls(id));
  }
  return Read(root_ / id);
}

std::vector<PhotoSet> PhotoSets::List() const {
  std::vector<PhotoSet> sets;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root_, error)) {
    if (!IsId(entry.path().filename())) continue;
    try {
      sets.push_back(Read(entry.path()));
    } catch (const Error&) {  // being made, or damaged: not offered
    }
  }
  std::ranges::sort(sets, [](const PhotoSet& a, const PhotoSet& b) {
    return a.created_s != b.created_s ? a.created_s > b.created_s : a.id < b.id;
  });
  return sets;
}

void PhotoSets::SetScene(const std::string& id, const std::string& scene) {
  const MutexLock lock(mutex_);
  PhotoSet set = Get(id);
  if (set.scene == scene) return;
  set.scene = scene;
  Write(set);
}

void PhotoSets::SetAsFrames(const std::string& id, bool as_frames) {
  const MutexLock lock(mutex_);
  PhotoSet set = Get(id);
  if (set.as_frames == as_frames) return;
  set.as_frames = as_frames;
  set.scene.clear();
  Write(set);
}

int64_t PhotoSets::Receive(const std::string& id,
                           const std::string& name,
                           const std::function<bool(const Sink&)>& fill) {
  const PhotoSet set = Get(id);
  if (!set.is_own) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} is your own folder; put the file there and reload the page",
                set.folder.string());
  }
  if (!IsSafeRelativePath(name) || !IsUtf8(name) || name.size() > 1000) {
    throw InvalidArgument("the file name '{}' cannot be used; rename the file",
                          EscapeControls(CleanUtf8(name, 200)));
  }
  const fs::path file = SafePathBelow(set.folder, name);
  PartFile part(root_ / id / (".part-" + NewUuid()));
  int64_t bytes = 0;
  const bool is_whole = fill([&](const char* piece, size_t count) {
    part.Append(piece, count);
    bytes += static_cast<int64_t>(count);
    return true;
  });
  if (!is_whole) throw Error(ErrorCode::kAborted, "{} did not arrive whole; drop it again", name);
  part.Keep(file);
  return bytes;
}

fs::path PhotoSets::KeepPicture(const std::string& id,
                                const std::string& ending,
                                const std::string& bytes) {
  const PhotoSet set = Get(id);
  const fs::path file = root_ / set.id / (Sha256Hex(bytes).substr(0, 32) + ending);
  WriteFileAtomic(file, bytes);
  return file;
}

fs::path PhotoSets::KeptPicture(const std::string& id, const std::string& name) const {
  const PhotoSet set = Get(id);
  const size_t dot = name.rfind('.');
  std::error_code none;
  // As KeepPicture names them, so that nothing else in the folder is meant.
  if (dot != 32 || !IsId(name.substr(0, dot)) || name.find('/') != name.npos) {
    throw InvalidArgument("the picture is missing; bring the coloured photo again");
  }
  if (!fs::is_regular_file(fs::symlink_status(root_ / id / name, none))) {
    throw Error(ErrorCode::kNotFound, "the picture is gone; bring the coloured photo again");
  }
  return root_ / id / name;
}

}  // namespace color3d::client
