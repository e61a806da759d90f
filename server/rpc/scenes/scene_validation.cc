#include "server/rpc/scenes/scene_validation.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/catalogue/pose_files.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"
#include "server/base/service_error.h"
#include "server/planning/scene_facts.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/scenes/transforms_outline.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kMaxTransformsBytes = int64_t{64} << 20;  // 10,000 photos need about 10
constexpr int64_t kMaxTimesBytes = int64_t{16} << 20;       // about 10 with the longest names

// Reads the whole file. An unreadable page of a mapped file would end the server by a signal.
bool IsReadable(int fd, size_t size, const std::function<bool()>& is_cancelled) {
  std::vector<char> piece(std::min<size_t>(size, 1 << 20));
  for (size_t at = 0; at < size;) {
    if (is_cancelled()) throw Error(ErrorCode::kCancelled, "the caller has disconnected");
    const ssize_t got = ::pread(fd, piece.data(), piece.size(), static_cast<off_t>(at));
    if (got <= 0) return false;
    at += static_cast<size_t>(got);
  }
  return true;
}

// Read-only memory map of a file, so that the heap does not grow.
class MappedFile {
 public:
  MappedFile(const fs::path& path, int64_t size, const std::function<bool()>& is_cancelled)
      : size_(static_cast<size_t>(size)) {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return;
    const std::shared_ptr<void> closed(nullptr, [fd](void*) { ::close(fd); });
    is_readable_ = IsReadable(fd, size_, is_cancelled);
    if (is_readable_ && size_ > 0) data_ = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, fd, 0);
  }
  ~MappedFile() {
    if (data_ != MAP_FAILED) ::munmap(data_, size_);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  bool is_readable() const { return is_readable_; }
  std::string_view bytes() const {
    if (data_ == MAP_FAILED) return {};
    return {static_cast<const char*>(data_), size_};
  }

 private:
  void* data_ = MAP_FAILED;
  bool is_readable_ = false;
  size_t size_;
};

std::string BaseName(const std::string& path) { return path.substr(path.rfind('/') + 1); }
std::vector<std::string> PathsOf(const std::vector<SceneFileRecord>& files) {
  std::vector<std::string> paths;
  for (const SceneFileRecord& file : files) paths.push_back(file.path);
  return paths;
}

bool IsTransforms(const std::string& path) {
  return path == BaseName(path) && IsTransformsFile(path);
}

// Returns why the file is not a transforms.json; empty if it is.
std::string TransformsProblem(std::string_view bytes, bool needs_frames) {
  const TransformsOutline outline = OutlineOfTransforms(bytes);
  if (!outline.error.empty()) return "is not JSON: " + outline.error;
  if (!outline.is_object) return "is not a JSON object";
  return outline.frames == 0 && needs_frames ? "has no \"frames\"" : "";
}

// Number of splats of a scene without photos.
int CountSplats(const std::vector<SceneFileRecord>& files) {
  return static_cast<int>(std::count_if(files.begin(), files.end(), [](const auto& file) {
    return HasSplatExtension(file.path) && !IsAugmentFile(file.path);
  }));
}

int CountFilms(const std::vector<SceneFileRecord>& files) {
  return static_cast<int>(std::count_if(files.begin(), files.end(), [](const auto& file) {
    return HasFilmExtension(file.path) && !IsAugmentFile(file.path);
  }));
}

// Problems of the files of a scene. Equal files are read once.
class FileChecks {
 public:
  FileChecks(const BlobStore& blobs,
             const ServiceLimits& limits,
             const std::function<bool()>& is_cancelled)
      : blobs_(blobs), limits_(limits), is_cancelled_(is_cancelled) {}

  // Adds the violation of a file, if any; counts good photos.
  void Check(const SceneFileRecord& file, bool is_held, SceneCheck* check);
  std::vector<FieldViolation> violations;

 private:
  // Empty: no problem. The message about a picture names the path that it was read for.
  struct Problem {
    std::string path, text;
  };
  enum class Part { kPicture, kTransforms, kTransformsWithFrames };
  static Part PartOf(const std::string& path);
  Problem ProblemOf(const SceneFileRecord& file, Part part) const;

  const BlobStore& blobs_;
  const ServiceLimits& limits_;
  const std::function<bool()>& is_cancelled_;
  // By digest and role of the file.
  std::map<std::pair<std::string, Part>, Problem> known_;
};

FileChecks::Part FileChecks::PartOf(const std::string& path) {
  if (!IsTransforms(path)) return Part::kPicture;
  const bool needs_frames = path == kTransformsFile || path == kBlenderFiles[0];
  return needs_frames ? Part::kTransformsWithFrames : Part::kTransforms;
}

FileChecks::Problem FileChecks::ProblemOf(const SceneFileRecord& file, Part part) const {
  std::optional<MappedFile> opened;
  blobs_.Borrow(file.digest.sha256, [&](const fs::path& path) {
    opened.emplace(path, file.digest.size_bytes, is_cancelled_);
  });
  const MappedFile& mapped = *opened;
  if (!mapped.is_readable()) {
    return {file.path, "cannot be read from the server's disk; upload it again"};
  }
  if (part != Part::kPicture) {
    return {file.path, TransformsProblem(mapped.bytes(), part == Part::kTransformsWithFrames)};
  }
  try {
    ImageLimits image_limits;
    image_limits.max_pixels = limits_.max_pixels_per_image;
    image_limits.max_side_px = limits_.max_image_side_px;
    ProbeImage(mapped.bytes(), file.path, image_limits);
    return {file.path, ""};
  } catch (const Error& e) {
    return {file.path, e.what()};
  }
}

void FileChecks::Check(const SceneFileRecord& file, bool is_held, SceneCheck* check) {
  if (is_cancelled_()) throw Error(ErrorCode::kCancelled, "the caller has disconnected");
  const auto refuse = [&](const std::string& why) { violations.push_back({file.path, why}); };
  if (!is_held || !blobs_.Touch(file.digest)) {
    return refuse(fmt::format("was not uploaded (blob {})", file.digest.sha256));
  }
  const bool is_photo = HasImageExtension(file.path);
  const bool is_transforms = IsTransforms(file.path);
  const bool is_augmentation = IsAugmentFile(file.path), is_mask = IsMaskFile(file.path);
  if (is_mask && !is_photo) return refuse("is not a PNG picture; remove it from masks/");
  if (is_augmentation && !is_photo) {
    return refuse(fmt::format("is not a readable picture ({}); remove it from augment/",
                              ReadableImageFormats()));
  }
  const int64_t max_bytes = is_transforms ? kMaxTransformsBytes : kMaxTimesBytes;
  if ((is_transforms || file.path == kTimesFile) && file.digest.size_bytes > max_bytes) {
    return refuse(
        fmt::format("has {} bytes; at most {} are allowed", file.digest.size_bytes, max_bytes));
  }
  if (!is_photo && !is_transforms) return;
  const std::pair<std::string, Part> key(file.digest.sha256, PartOf(file.path));
  auto known = known_.find(key);
  if (known == known_.end()) known = known_.emplace(key, ProblemOf(file, key.second)).first;
  Problem problem = known->second;
  if (problem.text.empty()) {
    if (is_photo && !is_augmentation && !is_mask) ++check->photo_count;
    return;
  }
  if (problem.text.starts_with(problem.path)) {
    problem.text.replace(0, problem.path.size(), file.path);
  }
  refuse(problem.text);
}

[[noreturn]] void ThrowInvalid(const SceneRecord& scene,
                               const std::vector<FieldViolation>& violations) {
  std::string message = scene.name + ": ";
  for (size_t i = 0; i < std::min<size_t>(3, violations.size()); ++i) {
    const FieldViolation& violation = violations[i];
    if (i > 0) message += "; ";
    // Errors of the probe already begin with the name of the file.
    const bool named =
        violation.field.empty() || violation.description.find(violation.field) != std::string::npos;
    message += (named ? "" : violation.field + " ") + violation.description;
  }
  if (violations.size() > 3) {
    message += fmt::format("; and {} more files", violations.size() - 3);
  }
  throw ServiceError(ErrorReason::kSceneInvalid, message, violations);
}

void CheckSceneId(const std::string& id) {
  if (id.empty()) return;
  const bool good =
      id.size() >= 4 && id.size() <= 63 && id[0] >= 'a' && id[0] <= 'z' &&
      id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
  if (!good) {
    throw InvalidArgument(
        "scene_id '{}' must be 4 to 63 characters of [a-z0-9-], the first a letter",
        id.substr(0, 80));
  }
}

}  // namespace

SceneRecord CheckedScene(const v1::CreateSceneRequest& request, const ServiceLimits& limits) {
  CheckSceneId(request.scene_id());
  if (request.display_name().size() > 200) {
    throw InvalidArgument("display_name has {} bytes; at most 200 are allowed",
                          request.display_name().size());
  }
  if (request.files_size() < 1 || request.files_size() > limits.max_files_per_scene) {
    throw InvalidArgument("files has {} entries; the range is 1 to {}",
                          request.files_size(),
                          limits.max_files_per_scene);
  }
  SceneRecord record;
  record.name = "scenes/" + (request.scene_id().empty() ? "s" + NewId() : request.scene_id());
  record.display_name = request.display_name();
  std::set<std::string> paths;
  int64_t path_bytes = 0;
  for (const v1::SceneFile& file : request.files()) {
    path_bytes += static_cast<int64_t>(file.path().size());
  }
  if (path_bytes > limits.max_manifest_bytes) {
    throw InvalidArgument(
        "the paths of files have {} bytes in sum; at most {} are allowed: use shorter names, or "
        "several scenes",
        path_bytes,
        limits.max_manifest_bytes);
  }
  for (const v1::SceneFile& file : request.files()) {
    if (!IsSafeRelativePath(file.path())) {
      throw ServiceError(
          ErrorReason::kUnsafePath,
          fmt::format("the path '{}' must be relative, with '/' separators and without '..'",
                      file.path().substr(0, 200)),
          {{"files.path", file.path().substr(0, 200)}});
    }
    if (!paths.insert(file.path()).second) {
      throw InvalidArgument("the path '{}' is listed twice", file.path());
    }
    record.files.push_back({file.path(), FromProto(file.digest())});
  }
  // "a" and "a/b" cannot both be files.
  for (const std::string& path : paths) {
    for (size_t slash = path.find('/'); slash != std::string::npos;
         slash = path.find('/', slash + 1)) {
      if (paths.count(path.substr(0, slash)) > 0) {
        throw InvalidArgument("'{}' is both a file and a folder", path.substr(0, slash));
      }
    }
  }
  return record;
}

SceneCheck CheckScene(const SceneRecord& scene,
                      const BlobStore& blobs,
                      const ProjectStore& store,
                      const ServiceLimits& limits,
                      const std::function<bool()>& is_cancelled) {
  SceneCheck check;
  std::vector<std::string> named;
  for (const SceneFileRecord& file : scene.files) named.push_back(file.digest.sha256);
  const std::set<std::string> held = store.HeldBlobs(named);
  FileChecks checks(blobs, limits, is_cancelled);
  std::vector<FieldViolation>& violations = checks.violations;
  const std::vector<std::string> paths = PathsOf(scene.files);
  check.layout = DetectCapture(paths);
  const std::vector<ColmapPlace> models = ColmapPlaces(paths);
  if (!models.empty() && !models[0].whole) {
    violations.push_back({models[0].files[0],
                          "belongs to an incomplete COLMAP model: cameras, images and "
                          "points3D are needed, all .bin or all .txt"});
  }
  size_t missing = 0;
  for (const SceneFileRecord& file : scene.files) {
    const size_t before = violations.size();
    checks.Check(file, held.contains(file.digest.sha256), &check);
    missing += violations.size() - before;
  }
  const ViewSource views = InfoOf(check.layout).views;
  if (views == ViewSource::kSplatRenders) {
    if (const int splats = CountSplats(scene.files); splats > 1) {
      violations.push_back({"",
                            fmt::format("the scene holds {} splats and no photos; give one "
                                        "splat per scene",
                                        splats)});
    }
  } else if (views == ViewSource::kFrames) {
    if (CountFilms(scene.files) > 0 && check.photo_count > 0) {
      violations.push_back(
          {"", "the scene holds pictures in frames/ and video files; give one of the two"});
    }
  } else if (missing == 0 && check.photo_count == 0 && CountFilms(scene.files) == 0) {
    violations.push_back({"",
                          fmt::format("the scene holds no photos ({}), no splat (.ply, .sog, "
                                      ".spz) and no film (.mp4, .mov, .mkv, ...)",
                                      ReadableImageEndings())});
  } else if (missing == 0 && check.photo_count == 1) {
    violations.push_back({"", "the scene holds one photo; at least 3 that overlap are needed"});
  }
  if (!violations.empty()) ThrowInvalid(scene, violations);
  return check;
}

}  // namespace color3d
