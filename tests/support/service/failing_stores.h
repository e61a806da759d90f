// Stores with one failing call, before or after its effect.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_job_store.h"

namespace color3d::testing {

// Counts the calls of its stores and makes one of them fail. Thread-safe.
class Faults {
 public:
  // `target`: number of the failing call, from 1; 0: none.
  Faults(int target, bool after, ErrorCode code) : target_(target), after_(after), code_(code) {}

  template <class Body>
  auto Around(const char* call, Body&& body) {
    const bool hit = ++calls_ == target_;
    {
      std::lock_guard lock(mutex_);
      seen_.insert(call);
      if (hit) failed_ = call;
    }
    if (hit && !after_) Throw();
    if constexpr (std::is_void_v<decltype(body())>) {
      body();
      if (hit) Throw();
    } else {
      auto result = body();
      if (hit) Throw();
      return result;
    }
  }
  int calls() const { return calls_.load(); }
  // Empty: no call has failed.
  std::string failed() const {
    std::lock_guard lock(mutex_);
    return failed_;
  }
  std::set<std::string> seen() const {
    std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  [[noreturn]] void Throw() const { throw Error(code_, "the disk did not answer"); }

  const int target_;
  const bool after_;
  const ErrorCode code_;
  std::atomic<int> calls_{0};
  mutable std::mutex mutex_;
  std::string failed_;
  std::set<std::string> seen_;
};

// Calls by workers.
class FailingStore : public SqliteJobStore {
 public:
  FailingStore(const std::filesystem::path& file, const Clocks& clocks, Faults& faults)
      : SqliteJobStore(file, StoreRole::kTool, clocks), faults_(faults) {}

  SceneRecord GetScene(const std::string& name) override {
    return faults_.Around("GetScene", [&] { return SqliteJobStore::GetScene(name); });
  }
  std::vector<JobRecord> ListChildren(const std::string& name) override {
    return faults_.Around("ListChildren", [&] { return SqliteJobStore::ListChildren(name); });
  }
  using WorkerStore::Claim;
  std::optional<JobRecord> Claim(const ClaimTerms& terms) override {
    return faults_.Around(terms.batch_kind.empty() ? "Claim" : "ClaimForBatch",
                          [&] { return SqliteJobStore::Claim(terms); });
  }
  std::vector<JobRecord> GetInputs(int64_t job_id) override {
    return faults_.Around("GetInputs", [&] { return SqliteJobStore::GetInputs(job_id); });
  }
  HeartbeatReply Heartbeat(const Lease& lease,
                           const ProgressRecord& progress,
                           const JobUsage& usage,
                           int64_t lease_ms) override {
    return faults_.Around(
        "Heartbeat", [&] { return SqliteJobStore::Heartbeat(lease, progress, usage, lease_ms); });
  }
  HeartbeatReply Peek(const Lease& lease) override {
    return faults_.Around("Peek", [&] { return SqliteJobStore::Peek(lease); });
  }
  std::optional<FileDigest> SetCheckpoint(const Lease& lease, const FileDigest& blob) override {
    return faults_.Around("SetCheckpoint",
                          [&] { return SqliteJobStore::SetCheckpoint(lease, blob); });
  }
  bool JoinEqual(const Lease& lease, const std::string& stage_key) override {
    return faults_.Around("JoinEqual", [&] { return SqliteJobStore::JoinEqual(lease, stage_key); });
  }
  void Publish(const Lease& lease, const Publication& publication) override {
    faults_.Around("Publish", [&] { SqliteJobStore::Publish(lease, publication); });
  }
  void Fail(const Lease& lease, const JobError& error, const JobUsage& usage) override {
    faults_.Around("Fail", [&] { SqliteJobStore::Fail(lease, error, usage); });
  }
  void Release(const Lease& lease, const JobUsage& usage) override {
    faults_.Around("Release", [&] { SqliteJobStore::Release(lease, usage); });
  }
  std::optional<JobRecord> FindStage(const std::string& stage_key) override {
    return faults_.Around("FindStage", [&] { return SqliteJobStore::FindStage(stage_key); });
  }
  bool IsReferenced(const std::string& sha256) override {
    return faults_.Around("IsReferenced", [&] { return SqliteJobStore::IsReferenced(sha256); });
  }
  void UpdateWorker(const WorkerRecord& worker) override {
    faults_.Around("UpdateWorker", [&] { SqliteJobStore::UpdateWorker(worker); });
  }
  void RemoveWorker(const std::string& worker_id) override {
    faults_.Around("RemoveWorker", [&] { SqliteJobStore::RemoveWorker(worker_id); });
  }

 private:
  Faults& faults_;
};

// Calls by workers and uploads.
class FailingBlobs : public FileBlobStore {
 public:
  FailingBlobs(const std::filesystem::path& folder, Faults& faults)
      : FileBlobStore(folder, {0}), faults_(faults) {}

  bool Touch(const FileDigest& digest) const override {
    return faults_.Around("Touch", [&] { return FileBlobStore::Touch(digest); });
  }
  std::filesystem::path Fetch(const std::string& sha256) const override {
    return faults_.Around("Fetch", [&] { return FileBlobStore::Fetch(sha256); });
  }
  FileDigest PutBytes(std::string_view bytes) override {
    return faults_.Around("PutBytes", [&] { return FileBlobStore::PutBytes(bytes); });
  }
  FileDigest PutFile(const std::filesystem::path& file) override {
    return faults_.Around("PutFile", [&] { return FileBlobStore::PutFile(file); });
  }
  void Adopt(const std::filesystem::path& file, const FileDigest& digest) override {
    faults_.Around("Adopt", [&] { FileBlobStore::Adopt(file, digest); });
  }
  std::optional<StoredBlob> Look(const std::string& sha256) const override {
    return faults_.Around("Look", [&] { return FileBlobStore::Look(sha256); });
  }
  bool RemoveIfUntouched(const StoredBlob& blob) override {
    return faults_.Around("RemoveIfUntouched",
                          [&] { return FileBlobStore::RemoveIfUntouched(blob); });
  }
  void RequireSpace(int64_t bytes) const override {
    faults_.Around("RequireSpace", [&] { FileBlobStore::RequireSpace(bytes); });
  }
  SpaceReservation Reserve(int64_t bytes) override {
    return faults_.Around("Reserve", [&] { return FileBlobStore::Reserve(bytes); });
  }

 private:
  Faults& faults_;
};

}  // namespace color3d::testing
