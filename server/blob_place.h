// Where a server keeps its blobs: in its data folder or in an object store.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "server/storage/blob_store.h"
#include "server/storage/data_folder.h"

namespace color3d {

struct BlobPlaceOptions {
  std::string blobs;     // "s3://BUCKET[/PREFIX]"; empty: the data folder
  std::string endpoint;  // http[s]://HOST[:PORT]; empty: Amazon's of the region
  std::string region = "us-east-1";
  std::filesystem::path credentials;  // file with the key
  std::filesystem::path authorities;  // PEM file; empty: those of the system
  double cache_gib = 10.0;            // of the server and the workers of this machine in all
  int64_t reserve_mib = 256;          // disk space to keep free

  bool IsElsewhere() const { return !blobs.empty(); }
};

struct OpenedBlobs {
  std::unique_ptr<BlobStore> blobs;
  std::string name;            // for logs
  std::function<void()> stop;  // ends requests under way, and refuses later ones
};

// Throws Error{kInvalidArgument} naming the flag at fault. Sends nothing.
void CheckBlobPlace(const BlobPlaceOptions& options);

// For a server, whose jobs are in `store`, the name of a PostgreSQL database, or in the data folder
// if that is empty. Tries the object store first (CheckBucket, ClaimBucket), and notes the place in
// the data folder. Throws Error{kFailedPrecondition} if the blobs of the folder are elsewhere.
OpenedBlobs OpenBlobs(const BlobPlaceOptions& options,
                      const DataPaths& paths,
                      const std::string& store);

// For a command of an operator. Null if the blobs are in the data folder.
std::unique_ptr<BlobStore> OpenBlobsAsTool(const BlobPlaceOptions& options, const DataPaths& paths);

// Cache of each of the workers of this machine, MiB; 0: they share the folder of blobs.
int64_t WorkerCacheMib(const BlobPlaceOptions& options, int workers);

}  // namespace color3d
