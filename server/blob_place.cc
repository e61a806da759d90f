#include "server/blob_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <system_error>

#include "core/base/error.h"
#include "core/base/files.h"
#include "server/access/access_key_file.h"
#include "server/storage/file_blob_store.h"
#include "server/storage/s3/s3_blob_store.h"
#include "server/storage/s3/s3_check.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr double kGib = 1024.0 * 1024.0 * 1024.0;

S3Options S3OptionsOf(const BlobPlaceOptions& options) {
  CheckBlobPlace(options);
  S3Options s3;
  s3.target = ParseS3Target(options.blobs, options.endpoint, options.region);
  s3.target.authorities = options.authorities;
  const auto file = std::make_shared<AccessKeyFile>(options.credentials);
  s3.key = [file] {
    const AccessKey key = file->Latest();
    return S3Key{key.id, key.secret, key.session_token};
  };
  return s3;
}

S3BlobOptions BlobOptionsOf(const BlobPlaceOptions& options, const fs::path& cache) {
  S3BlobOptions blobs;
  blobs.s3 = S3OptionsOf(options);
  blobs.folder = cache;
  // The other half is for the workers.
  blobs.cache_bytes = static_cast<int64_t>(options.cache_gib / 2.0 * kGib);
  blobs.reserve_bytes = options.reserve_mib << 20;
  return blobs;
}

bool HasBlobs(const DataPaths& paths) {
  bool found = false;
  FileBlobStore(paths.Blobs()).ForEach([&](const StoredBlob&) {
    found = true;
    return false;
  });
  return found;
}

// `place`: the name of the object store; empty: the folder.
void RequirePlace(const DataPaths& paths, const std::string& place) {
  const std::string known = BlobPlaceOf(paths);
  if (known == place) return;
  if (!known.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the blobs of {} are in {}: give --blobs {}; or, if all were copied to {}, remove "
                "the file {}",
                paths.root.string(),
                known,
                known,
                place.empty() ? paths.Blobs().string() : place,
                paths.BlobPlace().string());
  }
  if (!HasBlobs(paths)) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "{} has blobs: copy them to {}/blobs, move {} away and start again "
              "(deploy/README.md, \"Blobs in an object store\")",
              paths.Blobs().string(),
              place,
              paths.Blobs().string());
}

// A name of this folder's jobs that stays the same.
std::string FolderName(const DataPaths& paths) {
  const fs::path file = paths.root / "store-id";
  std::error_code error;
  if (!fs::exists(file, error)) {
    std::random_device random;
    WriteFileAtomic(file, fmt::format("folder {:08x}{:08x}{:08x}\n", random(), random(), random()));
  }
  std::string name = ReadFile(file);
  while (name.ends_with('\n')) name.pop_back();
  return name;
}

}  // namespace

void CheckBlobPlace(const BlobPlaceOptions& options) {
  if (!options.IsElsewhere()) {
    if (options.endpoint.empty() && options.credentials.empty() && options.authorities.empty()) {
      return;
    }
    throw InvalidArgument("the flags --s3-... require --blobs s3://BUCKET[/PREFIX]");
  }
  ParseS3Target(options.blobs, options.endpoint, options.region);
  if (options.credentials.empty()) {
    throw InvalidArgument(
        "--blobs {} requires --s3-credentials-file, a file with access_key_id = ID and "
        "secret_access_key = SECRET that only its owner may read",
        options.blobs);
  }
  std::error_code error;
  if (!options.authorities.empty() && !fs::is_regular_file(options.authorities, error)) {
    throw InvalidArgument("--s3-ca {}: there is no such file", options.authorities.string());
  }
}

OpenedBlobs OpenBlobs(const BlobPlaceOptions& options,
                      const DataPaths& paths,
                      const std::string& store) {
  if (!options.IsElsewhere()) {
    RequirePlace(paths, "");
    return {
        std::make_unique<FileBlobStore>(paths.Blobs(), BlobStoreOptions{options.reserve_mib << 20}),
        paths.Blobs().string(),
        [] {}};
  }
  const S3BlobOptions blobs = BlobOptionsOf(options, paths.BlobCache());
  const std::string place = blobs.s3.target.Name();
  RequirePlace(paths, place);
  CheckBucket(blobs.s3);
  ClaimBucket(blobs.s3, store.empty() ? FolderName(paths) : store);
  WriteFileAtomic(paths.BlobPlace(), place + "\n");
  auto opened = std::make_unique<S3BlobStore>(blobs);
  S3BlobStore* const raw = opened.get();
  return {std::move(opened), place + " at " + blobs.s3.target.Endpoint(), [raw] { raw->Stop(); }};
}

std::unique_ptr<BlobStore> OpenBlobsAsTool(const BlobPlaceOptions& options,
                                           const DataPaths& paths) {
  CheckBlobPlace(options);
  if (!options.IsElsewhere()) return nullptr;
  const S3BlobOptions blobs = BlobOptionsOf(options, paths.BlobCache());
  RequirePlace(paths, blobs.s3.target.Name());
  CheckBucket(blobs.s3);
  return std::make_unique<S3BlobStore>(blobs);
}

int64_t WorkerCacheMib(const BlobPlaceOptions& options, int workers) {
  if (!options.IsElsewhere()) return 0;
  const double mib = options.cache_gib * 1024.0 / 2.0 / std::max(1, workers);
  return std::max<int64_t>(1, static_cast<int64_t>(mib));
}

}  // namespace color3d
