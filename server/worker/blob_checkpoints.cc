#include "server/worker/blob_checkpoints.h"

#include <spdlog/spdlog.h>

#include "core/base/files.h"
#include "server/worker/lease_keeper.h"

namespace color3d {

BlobCheckpoints::BlobCheckpoints(JobStore& store,
                                 BlobStore& blobs,
                                 const JobRecord& job,
                                 std::chrono::milliseconds interval)
    : store_(store),
      blobs_(blobs),
      lease_{job.id, job.lease_epoch},
      tag_(AttemptTag(job)),
      interval_(interval),
      newest_(job.checkpoint) {}

std::optional<std::string> BlobCheckpoints::Load() {
  if (!newest_) return std::nullopt;
  try {
    return ReadFile(blobs_.Fetch(newest_->sha256));
  } catch (const Error& e) {
    spdlog::warn("{} the checkpoint is gone, starting afresh: {}", tag_, e.what());
    return std::nullopt;
  }
}

bool BlobCheckpoints::WantsSave() {
  return std::chrono::steady_clock::now() - last_save_ >= interval_;
}

void BlobCheckpoints::Save(const std::string& state) {
  const FileDigest digest = blobs_.PutBytes(state);
  const std::optional<FileDigest> before = store_.SetCheckpoint(lease_, digest);
  newest_ = digest;
  last_save_ = std::chrono::steady_clock::now();
  if (before && before->sha256 != digest.sha256 && !store_.IsReferenced(before->sha256)) {
    blobs_.Remove(before->sha256);
  }
}

void BlobCheckpoints::RemoveNewest() {
  if (newest_ && !store_.IsReferenced(newest_->sha256)) blobs_.Remove(newest_->sha256);
}

}  // namespace color3d
