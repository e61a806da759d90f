// Uploads a local folder as a scene: digests, uploads, CreateScene, CommitScene.
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

// Returns the maximum file size of the server, bytes. Throws RpcError.
int64_t MaxFileBytes(Connection& connection);

// Computes the digests of all files. Before it sends anything or reads a long film, throws
// Error{kInvalidArgument} for a file larger than `max_file_bytes`, and one that lists up to 10
// photos that are damaged or no images.
std::vector<SceneEntry> BuildManifest(const PhotoFolder& folder,
                                      int64_t max_file_bytes,
                                      const CancellationToken& cancel);

// Uploads missing files, creates and commits the scene. Its id is derived from its files, so the
// same folder gives the same scene. Throws RpcError with a violation for each file that the server
// refuses.
v1::Scene UploadScene(Connection& connection,
                      const std::vector<SceneEntry>& entries,
                      const std::string& display_name,
                      const TransferProgress& progress);

v1::Digest ToProto(const FileDigest& digest);

}  // namespace color3d::client
