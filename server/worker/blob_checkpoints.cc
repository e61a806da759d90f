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
      pace_(interval, std::chrono::steady_clock::now()),
      newest_(job.checkpoint) {}

std::optional<std::filesystem::path> BlobCheckpoints::Newest() {
  if (!newest_) return std::nullopt;
  try {
    return blobs_.Fetch(newest_->sha256);
  } catch (const Error& e) {
    spdlog::warn("{} the checkpoint is gone, starting afresh: {}", tag_, e.what());
    return std::nullopt;
  }
}

std::optional<std::string> BlobCheckpoints::Load() {
  const auto file = Newest();
  return file ? std::optional(ReadFile(*file)) : std::nullopt;
}

bool BlobCheckpoints::LoadTo(const std::filesystem::path& file) {
  const auto newest = Newest();
  if (newest) {
    std::filesystem::copy_file(*newest, file, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::permissions(
        file, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  }
  return newest.has_value();
}

bool BlobCheckpoints::WantsSave() { return pace_.IsDue(std::chrono::steady_clock::now()); }

void BlobCheckpoints::Save(const std::string& state) { Name(blobs_.PutBytes(state)); }

void BlobCheckpoints::SaveFile(const std::filesystem::path& file) { Name(blobs_.PutFile(file)); }

void BlobCheckpoints::Name(const FileDigest& digest) {
  const std::optional<FileDigest> before = store_.SetCheckpoint(lease_, digest);
  newest_ = digest;
  pace_.OnSaved(std::chrono::steady_clock::now());
  if (before && before->sha256 != digest.sha256 && !store_.IsReferenced(before->sha256)) {
    blobs_.Remove(before->sha256);
  }
}

void BlobCheckpoints::RemoveNewest() {
  if (newest_ && !store_.IsReferenced(newest_->sha256)) blobs_.Remove(newest_->sha256);
}

}  // namespace color3d
