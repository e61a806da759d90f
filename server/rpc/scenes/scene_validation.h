// Validation of scenes: requests of CreateScene, and the files of a scene before CommitScene makes
// it immutable (all blobs stored, all files valid, enough photos, a known layout).
#pragma once

#include <functional>

#include "color3d/v1/scene.pb.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/storage/blob_store.h"
#include "server/store/job.h"

namespace color3d {

// Returns the scene that a request declares, with a new id if it names none. Throws
// Error{kInvalidArgument}: bad id, too many files, paths that are too long in sum, a path that is
// unsafe (UNSAFE_PATH), listed twice or both file and folder, no digest.
SceneRecord CheckedScene(const v1::CreateSceneRequest& request, const ServiceLimits& limits);

struct SceneCheck {
  CaptureLayout layout = CaptureLayout::kPhotos;
  int photo_count = 0;
};

// Checks blobs that the project of `store` holds; each is read once, whatever number of paths it
// has. Throws Error{kCancelled} once `is_cancelled` returns true. Throws
// ServiceError{kInvalidArgument, SCENE_INVALID} with one violation for each bad file; its message
// names the first three and counts the rest.
SceneCheck CheckScene(const SceneRecord& scene,
                      const BlobStore& blobs,
                      const ProjectStore& store,
                      const ServiceLimits& limits,
                      const std::function<bool()>& is_cancelled);

}  // namespace color3d
