// Fuzz target: CreateScene requests, and the checks of CommitScene.
#include "core/base/files.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/scenes/scene_validation.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_job_store.h"
#include "tests/fuzz/request_checks.h"
#include "tests/support/service/rpc_support.h"

namespace color3d {
namespace {

constexpr char kTransforms[] = R"({"frames": [{"file_path": "a.png"}]})";

// A store with blobs that requests may name.
struct Fixture {
  ScratchFolder scratch;
  FileBlobStore blobs{scratch.path(), {0}};
  SqliteJobStore store{scratch.path() / "jobs.db", StoreRole::kServer, SystemClocks()};
  ProjectStore project{store, ""};
  std::vector<FileDigest> stored;
  Fixture() {
    for (const std::string& bytes : {testing::TinyPng(), std::string(kTransforms), std::string()}) {
      stored.push_back(blobs.PutBytes(bytes));
      project.HoldBlob(stored.back());
    }
  }
};

Fixture& Shared() {
  static Fixture fixture;
  return fixture;
}

std::string RequestOf(const std::vector<std::pair<std::string, int>>& files,
                      const std::string& id = "") {
  v1::CreateSceneRequest request;
  request.set_scene_id(id);
  for (const auto& [path, blob] : files) {
    v1::SceneFile* file = request.add_files();
    file->set_path(path);
    *file->mutable_digest() = ToProto(Shared().stored[static_cast<size_t>(blob)]);
  }
  return request.SerializeAsString();
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  return {RequestOf({{"images/a.png", 0}, {"images/b.png", 0}}, "a-scene"),
          RequestOf({{"a.png", 0}, {"b.png", 0}, {"transforms.json", 1}, {"masks/a.png", 0}}),
          RequestOf({{"a.png", 0},
                     {"sparse/0/cameras.txt", 2},
                     {"sparse/0/images.txt", 2},
                     {"sparse/0/points3D.txt", 2}}),
          RequestOf({{"film.mp4", 2}, {"other.mov", 2}, {"poses_bounds.npy", 2}}),
          RequestOf({{"a", 2}, {"a/b", 2}, {"../x", 2}, {"", 2}}),
          RequestOf({{"scene.ply", 2}})};
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  v1::CreateSceneRequest request;
  if (!ParseRequest(data, size, &request)) return 0;
  return AnswerOrRefuse([&] {
    const ServiceLimits limits;
    const SceneRecord scene = CheckedScene(request, limits);
    for (const SceneFileRecord& file : scene.files) {
      if (!IsSafeRelativePath(file.path) || !IsSha256Hex(file.digest.sha256)) std::abort();
    }
    const SceneCheck check =
        CheckScene(scene, Shared().blobs, Shared().project, limits, [] { return false; });
    std::vector<std::string> paths;
    for (const SceneFileRecord& file : scene.files) paths.push_back(file.path);
    if (check.layout != DetectCapture(paths) || check.photo_count < 0) std::abort();
  });
}
