// Checkpoints of a running job as blobs, named by a fenced update of the job's row. Only the newest
// is kept. Used by the stage's thread.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/base/progress.h"
#include "server/storage/blob_store.h"
#include "server/store/worker_store.h"
#include "server/worker/checkpoint_pace.h"

namespace color3d {

class BlobCheckpoints : public CheckpointStore {
 public:
  BlobCheckpoints(WorkerStore& store,
                  BlobStore& blobs,
                  const JobRecord& job,
                  std::chrono::milliseconds interval);
  std::optional<std::string> Load() override;
  bool WantsSave() override;
  void Save(const std::string& state) override;
  bool LoadTo(const std::filesystem::path& file) override;
  void SaveFile(const std::filesystem::path& file) override;
  // After the job was published: its checkpoint is of no more use.
  void RemoveNewest();

 private:
  std::optional<std::filesystem::path> Newest();
  // Puts the blob and makes it the checkpoint.
  void Replace(const FileDigest& digest, const std::function<void()>& put);
  // Removes what this attempt has stored, unless somebody else counts on the same bytes: he may
  // name them at any time.
  void RemoveOwn(const StoredBlob& blob);

  WorkerStore& store_;
  BlobStore& blobs_;
  const Lease lease_;
  const std::string tag_;  // of log lines
  CheckpointPace pace_;
  std::optional<FileDigest> newest_;
  // The newest as it was stored, where nobody had stored its bytes before.
  std::optional<StoredBlob> own_;
};

}  // namespace color3d
