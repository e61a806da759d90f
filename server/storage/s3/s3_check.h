// What a server tries before it begins to use a bucket. Stateless.
#pragma once

#include "server/storage/s3/s3_client.h"

namespace color3d {

// Writes, reads, lists and removes a small object. Throws Error{kFailedPrecondition} with the
// remedy for what the operator must mend (bucket, keys, permissions, region, clock), and
// Error{kUnavailable} if the store cannot be reached.
void CheckBucket(const S3Options& options);

// Notes in the bucket that its blobs are those of the jobs in `store`, a name that stays the same.
// Throws Error{kFailedPrecondition} if they are another store's, whose collection would remove
// blobs of this one.
void ClaimBucket(const S3Options& options, const std::string& store);

}  // namespace color3d
