#include "client/lib/scene_upload.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/text.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/text/utf8.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace {

constexpr size_t kMaxListed = 10;
constexpr size_t kMaxDisplayNameBytes = 200;
// The server reads every file once.
constexpr std::chrono::seconds kCommitTimeLimit{600};

[[noreturn]] void ThrowBadPhotos(const std::vector<std::string>& complaints) {
  std::string message = complaints[0];
  if (complaints.size() > 1) {
    message = fmt::format("{} photographs cannot be used:", complaints.size());
    for (size_t i = 0; i < std::min(complaints.size(), kMaxListed); ++i) {
      message += "\n  " + complaints[i];
    }
    if (complaints.size() > kMaxListed) message += "\n  ...";
  }
  throw InvalidArgument(message);
}

void CheckSizes(const std::vector<LocalFile>& files, int64_t max_bytes) {
  for (const LocalFile& file : files) {
    std::error_code unreadable;  // reported when the file is read
    const auto bytes = static_cast<int64_t>(std::filesystem::file_size(file.file, unreadable));
    if (unreadable || bytes <= max_bytes) continue;
    throw InvalidArgument(
        "{} has {}; the server takes files of up to {}: cut it into parts, or encode it smaller",
        file.file.string(),
        HumanBytes(bytes),
        HumanBytes(max_bytes));
  }
}

// Derives the id from the paths and digests of all files.
std::string SceneIdOf(const std::vector<SceneEntry>& entries) {
  Sha256 hash;
  for (const SceneEntry& entry : entries) {
    hash.Update(entry.local.path + '\n' + entry.digest.sha256 + '\n');
  }
  return "photos-" + hash.FinishHex().substr(0, 32);
}

std::string Shortened(const std::string& name) {
  if (name.size() <= kMaxDisplayNameBytes && IsUtf8(name)) return name;
  const std::string cut = name.substr(0, kMaxDisplayNameBytes);
  return IsUtf8(cut) ? cut : "";
}

std::optional<v1::Scene> FindScene(Connection& connection, const std::string& name) {
  try {
    return GetScene(connection, name);
  } catch (const RpcError& e) {
    if (e.code() != ErrorCode::kNotFound) throw;
    return std::nullopt;
  }
}

}  // namespace

v1::Digest ToProto(const FileDigest& digest) {
  v1::Digest proto;
  proto.set_sha256(digest.sha256);
  proto.set_size_bytes(digest.size_bytes);
  return proto;
}

int64_t MaxFileBytes(Connection& connection) {
  return GetServerInfo(connection).limits().max_blob_bytes();
}

std::vector<SceneEntry> BuildManifest(const PhotoFolder& folder,
                                      int64_t max_file_bytes,
                                      const CancellationToken& cancel) {
  const std::vector<LocalFile> files = folder.AllFiles();
  CheckSizes(files, max_file_bytes);
  std::vector<SceneEntry> entries(files.size());
  std::vector<std::string> complaint(files.size());
  ThreadPool pool(2);
  pool.ForEach(static_cast<int64_t>(files.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    entries[i].local = files[i];
    if (!HasImageExtension(files[i].path)) {
      entries[i].digest = DigestFile(files[i].file);
      return;
    }
    const std::string bytes = ReadFile(files[i].file);
    entries[i].digest = {Sha256Hex(bytes), static_cast<int64_t>(bytes.size())};
    try {
      ProbeImage(bytes, files[i].file.string());
    } catch (const Error& e) {
      complaint[i] = e.what();
    }
  });
  std::erase(complaint, "");
  if (!complaint.empty()) ThrowBadPhotos(complaint);
  return entries;
}

v1::Scene UploadScene(Connection& connection,
                      const std::vector<SceneEntry>& entries,
                      const std::string& display_name,
                      const TransferProgress& progress) {
  const std::string id = SceneIdOf(entries);
  std::optional<v1::Scene> scene = FindScene(connection, "scenes/" + id);
  if (scene && scene->state() == v1::Scene::STATE_ACTIVE) return *scene;
  if (!scene) {
    v1::CreateSceneRequest request;
    for (const SceneEntry& entry : entries) {
      v1::SceneFile* file = request.add_files();
      file->set_path(entry.local.path);
      *file->mutable_digest() = ToProto(entry.digest);
    }
    request.set_scene_id(id);
    request.set_display_name(Shortened(display_name));
    request.set_request_id(NewUuid());
    try {
      scene = connection.Call(&v1::SceneService::Stub::CreateScene, connection.scenes(), request);
    } catch (const RpcError& e) {  // another client created the same scene
      if (e.code() != ErrorCode::kAlreadyExists) throw;
      scene = FindScene(connection, "scenes/" + id);
      if (!scene) throw;
    }
  }
  std::vector<UploadFile> files;
  for (const SceneEntry& entry : entries) files.push_back({entry.local.file, entry.digest});
  UploadMissing(connection, files, progress);
  v1::CommitSceneRequest commit;
  commit.set_name(scene->name());
  commit.set_request_id(NewUuid());
  return connection.Call(
      &v1::SceneService::Stub::CommitScene, connection.scenes(), commit, kCommitTimeLimit);
}

}  // namespace color3d::client
