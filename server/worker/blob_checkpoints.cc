#include "server/worker/blob_checkpoints.h"

#include <spdlog/spdlog.h>

#include "core/base/files.h"
#include "server/worker/lease_keeper.h"

namespace color3d {

BlobCheckpoints::BlobCheckpoints(WorkerStore& store,
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
    spdlog::warn("{} the checkpoint is missing, starting over: {}", tag_, e.what());
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

void BlobCheckpoints::Save(const std::string& state) {
  Replace({Sha256Hex(state), static_cast<int64_t>(state.size())}, [&] { blobs_.PutBytes(state); });
}

void BlobCheckpoints::SaveFile(const std::filesystem::path& file) {
  const FileDigest digest = DigestFile(file);
  Replace(digest, [&] { blobs_.Adopt(file, digest); });
}

void BlobCheckpoints::Replace(const FileDigest& digest, const std::function<void()>& put) {
  const std::optional<StoredBlob> there = blobs_.Look(digest.sha256);
  const bool is_ours = !there || (own_ && own_->digest.sha256 == digest.sha256 &&
                                  own_->touched_ns == there->touched_ns);
  put();
  const std::optional<StoredBlob> stored = is_ours ? blobs_.Look(digest.sha256) : std::nullopt;
  store_.SetCheckpoint(lease_, digest);
  if (own_ && own_->digest.sha256 != digest.sha256) RemoveOwn(*own_);
  newest_ = digest;
  own_ = stored;
  pace_.OnSaved(std::chrono::steady_clock::now());
}

void BlobCheckpoints::RemoveOwn(const StoredBlob& blob) {
  if (!store_.IsReferenced(blob.digest.sha256)) blobs_.RemoveIfUntouched(blob);
}

// The sweep removes checkpoints of earlier attempts.
void BlobCheckpoints::RemoveNewest() {
  if (own_) RemoveOwn(*own_);
  own_.reset();
}

}  // namespace color3d
