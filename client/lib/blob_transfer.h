// Transfers files to and from the server's blob store, resumable in both directions. Not
// thread-safe; one transfer at a time is enough to fill a connection.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "client/lib/connection.h"
#include "core/base/digest.h"

namespace color3d::client {

// A file to store on the server under its digest.
struct UploadFile {
  std::filesystem::path file;
  FileDigest digest;
};

// Called after each chunk: bytes sent, of all bytes to send.
using TransferProgress = std::function<void(int64_t done_bytes, int64_t total_bytes)>;

// Sends the files that the server lacks, each once. After a broken connection it resumes at the
// committed size, until 30 s pass without progress. Throws RpcError, and Error{kInvalidArgument} if
// a file has changed since its digest was computed.
void UploadMissing(Connection& connection,
                   const std::vector<UploadFile>& files,
                   const TransferProgress& progress);

// Writes the blob to `path` atomically: into a hidden file beside it, which a later call resumes,
// then verified and renamed. Sends no request if `path` already has these bytes. Throws RpcError,
// Error{kDataLoss} if other bytes arrive, Error{kResourceExhausted} if the disk is full.
void DownloadBlob(Connection& connection,
                  const FileDigest& digest,
                  const std::filesystem::path& path,
                  const std::function<void(int64_t received_bytes)>& progress);

}  // namespace color3d::client
