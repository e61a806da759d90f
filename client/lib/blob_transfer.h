// Files to and from the server's blob store, resumable in both directions. Not thread-safe; one
// transfer at a time on a connection is enough to fill it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "client/lib/connection.h"
#include "core/base/digest.h"

namespace color3d::client {

// A file that is to be on the server under its digest.
struct UploadFile {
  std::filesystem::path file;
  FileDigest digest;
};

// Called after every chunk: bytes that are there, of all the bytes that had to be sent.
using TransferProgress = std::function<void(int64_t done_bytes, int64_t total_bytes)>;

// Sends those that the server lacks, each once. A broken connection resumes at the committed size,
// until 30 s pass without any progress. Throws RpcError, and Error{kInvalidArgument} when a file
// has changed since its digest was taken.
void UploadMissing(Connection& connection,
                   const std::vector<UploadFile>& files,
                   const TransferProgress& progress);

// Writes the blob to `path`, whole or not at all: into a hidden file beside it, which a later call
// resumes, then verified and renamed. Nothing is sent when `path` holds the bytes already. Throws
// RpcError, Error{kDataLoss} when what came is not what was asked for, Error{kResourceExhausted}
// when the disk is full.
void DownloadBlob(Connection& connection,
                  const FileDigest& digest,
                  const std::filesystem::path& path,
                  const std::function<void(int64_t received_bytes)>& progress);

}  // namespace color3d::client
