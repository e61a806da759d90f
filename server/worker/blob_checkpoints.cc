#include "server/worker/blob_checkpoints.h"

#include <spdlog/spdlog.h>

#include "core/base/files.h"
#include "server/base/service_error.h"
#include "server/worker/lease_keeper.h"

namespace color3d {

BlobCheckpoints::BlobCheckpoints(WorkerStore& store,
                                 WorkerBlobs& blobs,
                                 const JobRecord& job,
                                 std::chrono::milliseconds interval)
    : store_(store),
      blobs_(blobs),
      lease_{job.id, job.lease_epoch},
      tag_(AttemptTag(job)),
      pace_(interval, std::chrono::steady_clock::now()),
      newest_(job.checkpoint) {}

bool BlobCheckpoints::UseNewest(const std::function<void(const std::filesystem::path&)>& use) {
  if (!newest_) return false;
  bool found = false;
  try {
    blobs_.Borrow(newest_->sha256, [&](const std::filesystem::path& file) {
      found = true;
      use(file);
    });
  } catch (const Error& e) {
    // The server may answer the next attempt.
    const bool is_away =
        e.code() == ErrorCode::kUnavailable && !HasReason(e, ErrorReason::kBlobUnreadable);
    if (found || is_away) throw;
    spdlog::warn("{} the checkpoint is missing, starting over: {}", tag_, e.what());
  }
  return found;
}

std::optional<std::string> BlobCheckpoints::Load() {
  std::optional<std::string> state;
  UseNewest([&](const std::filesystem::path& file) { state = ReadFile(file); });
  return state;
}

bool BlobCheckpoints::LoadTo(const std::filesystem::path& file) {
  return UseNewest([&](const std::filesystem::path& newest) {
    std::filesystem::copy_file(newest, file, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::permissions(
        file, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  });
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
