// The job store of a server, for a worker in another process or on another machine. Reads, and
// writes that a repetition does not change, are retried while the server does not answer; a claim
// is not. Errors are those of the store, and Error{kUnavailable} if the server does not answer.
// Thread-safe.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/store/worker_store.h"
#include "server/worker/remote/worker_link.h"

namespace color3d {

class RemoteStore : public WorkerStore {
 public:
  // The link must outlive the store. `release`: version of this program, for messages.
  RemoteStore(WorkerLink& link, std::string release, int32_t protocol = kWorkerProtocol)
      : link_(link), release_(std::move(release)), protocol_(protocol) {}

  SceneRecord GetScene(const std::string& name) override;
  JobRecord GetJob(const std::string& name) override;
  std::vector<JobRecord> GetInputs(int64_t job_id) override;
  std::vector<JobRecord> ListChildren(const std::string& name) override;
  bool IsReferenced(const std::string& sha256) override;
  std::vector<WorkerRecord> ListWorkers() override;
  void RemoveWorker(const std::string& worker_id) override;

  using WorkerStore::Claim;
  std::optional<JobRecord> Claim(const ClaimTerms& terms) override;
  // One try, because the next heartbeat follows.
  HeartbeatReply Heartbeat(const Lease& lease,
                           const ProgressRecord& progress,
                           const JobUsage& usage,
                           int64_t lease_ms) override;
  HeartbeatReply Peek(const Lease& lease) override;
  std::optional<FileDigest> SetCheckpoint(const Lease& lease, const FileDigest& blob) override;
  // The following four end the lease. If the answer to the first try is lost, the next one may find
  // that: LEASE_LOST then means done or lost.
  bool JoinEqual(const Lease& lease, const std::string& stage_key) override;
  void Publish(const Lease& lease, const Publication& publication) override;
  void Fail(const Lease& lease, const JobError& error, const JobUsage& usage) override;
  void Release(const Lease& lease, const JobUsage& usage) override;
  std::optional<JobRecord> FindStage(const std::string& stage_key) override;
  void UpdateWorker(const WorkerRecord& worker) override;

 private:
  WorkerLink& link_;
  const std::string release_;
  const int32_t protocol_;
};

}  // namespace color3d
