// Checkpoints of a running job as blobs, recorded in the row of the job under its lease. Keeps only
// the newest. Not thread-safe.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/base/progress.h"
#include "server/storage/worker_blobs.h"
#include "server/store/worker_store.h"
#include "server/worker/checkpoint_pace.h"

namespace color3d {

class BlobCheckpoints : public CheckpointStore {
 public:
  BlobCheckpoints(WorkerStore& store,
                  WorkerBlobs& blobs,
                  const JobRecord& job,
                  std::chrono::milliseconds interval);
  std::optional<std::string> Load() override;
  bool WantsSave() override;
  void Save(const std::string& state) override;
  bool LoadTo(const std::filesystem::path& file) override;
  void SaveFile(const std::filesystem::path& file) override;
  // Removes the checkpoint. Called after the job was published.
  void RemoveNewest();

 private:
  // Calls `use` with the file of the checkpoint; returns false if there is none.
  bool UseNewest(const std::function<void(const std::filesystem::path&)>& use);
  // Stores the blob and makes it the checkpoint.
  void Replace(const FileDigest& digest, const std::function<void()>& put);
  // Removes a blob that this attempt has stored, unless others use the same bytes.
  void RemoveOwn(const StoredBlob& blob);

  WorkerStore& store_;
  WorkerBlobs& blobs_;
  const Lease lease_;
  const std::string tag_;  // of log lines
  CheckpointPace pace_;
  std::optional<FileDigest> newest_;
  // The newest, if its bytes were not stored before.
  std::optional<StoredBlob> own_;
};

}  // namespace color3d
