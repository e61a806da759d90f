// What CreateScene takes, and what CommitScene checks before a scene becomes immutable: every blob
// there, every file what it claims to be, enough photographs, a layout we know.
#pragma once

#include <functional>

#include "color3d/v1/scene.pb.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/storage/blob_store.h"
#include "server/store/job.h"

namespace color3d {

// The scene that a request declares, under a new id where it names none. Throws
// Error{kInvalidArgument}: bad id, too many files, paths that are too long in sum, a path that is
// unsafe (UNSAFE_PATH), there twice or both file and folder, no digest.
SceneRecord CheckedScene(const v1::CreateSceneRequest& request, const ServiceLimits& limits);

struct SceneCheck {
  StoredLayout layout = StoredLayout::kPhotos;
  int photo_count = 0;
};

// Of blobs that the project of `store` holds; each is read once, whatever paths it has.
// `is_cancelled` is asked while they are read: then throws Error{kCancelled}. Throws
// ServiceError{kInvalidArgument, SCENE_INVALID} with one violation for each bad file; its message
// names the first three and counts the rest.
SceneCheck CheckScene(const SceneRecord& scene,
                      const BlobStore& blobs,
                      const ProjectStore& store,
                      const ServiceLimits& limits,
                      const std::function<bool()>& is_cancelled);

// Which kind of input the paths look like; COLMAP wins over other poses.
StoredLayout DetectLayout(const std::vector<SceneFileRecord>& files);

}  // namespace color3d
