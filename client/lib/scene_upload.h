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

// The largest file that the server takes, bytes. Throws RpcError.
int64_t MaxFileBytes(Connection& connection);

// Digests of all files. Before anything is sent (or a long film read), throws
// Error{kInvalidArgument} for a file of more than `max_file_bytes`, and one that lists up to 10
// photos that are not whole images.
std::vector<SceneEntry> BuildManifest(const PhotoFolder& folder,
                                      int64_t max_file_bytes,
                                      const CancellationToken& cancel);

// Uploads what is missing, declares and commits the scene. Its id follows from its files, so the
// same folder gives the same scene. Throws RpcError; one with violations names each file that the
// server refuses.
v1::Scene UploadScene(Connection& connection,
                      const std::vector<SceneEntry>& entries,
                      const std::string& display_name,
                      const TransferProgress& progress);

v1::Digest ToProto(const FileDigest& digest);

}  // namespace color3d::client
