// A local folder becomes a scene on the server: digests, uploads, CreateScene, CommitScene.
#pragma once

#include <string>
#include <vector>

#include "client/lib/blob_transfer.h"
#include "client/lib/connection.h"
#include "client/lib/photos/photo_folder.h"
#include "core/base/digest.h"

namespace color3d::client {

struct SceneEntry {
  LocalFile local;
  FileDigest digest;
};

// Digests of all files. Photos are also checked to be whole images, so that a bad one is found
// before anything is sent: throws Error{kInvalidArgument} that lists up to 10 of them.
std::vector<SceneEntry> BuildManifest(const PhotoFolder& folder, const CancellationToken& cancel);

// Uploads what is missing, declares and commits the scene. Its id follows from its files, so the
// same folder gives the same scene. Throws RpcError; one with violations names each file that the
// server refuses.
v1::Scene UploadScene(Connection& connection,
                      const std::vector<SceneEntry>& entries,
                      const std::string& display_name,
                      const TransferProgress& progress);

v1::Digest ToProto(const FileDigest& digest);

}  // namespace color3d::client
