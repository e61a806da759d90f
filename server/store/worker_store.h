// The part of the job store that workers call. Every write is fenced by the lease (common_store.h).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/store/common_store.h"

namespace color3d {

struct HeartbeatReply {
  bool cancel_requested = false;
};

struct Publication {
  std::vector<ArtifactRecord> artifacts;
  std::string stage_key;  // empty: later equal jobs do not find it
  bool cached = false;
  JobUsage usage;
};

class WorkerStore : public virtual CommonStore {
 public:
  // Claims the next job of the queue unless the queue is held: the smallest priority first, then
  // the project that has waited longest since its last turn. Error{kFailedPrecondition,
  // WORKER_VERSION} for a worker of another release than the server's.
  virtual std::optional<JobRecord> Claim(const std::string& worker, int64_t lease_ms) = 0;
  // Claims a job of this kind to run beside those that the worker holds already. Leaves out jobs
  // that a worker was lost with, jobs that a waiting job of another kind comes before, and those
  // that `accept` refuses. Takes the project with the fewest running jobs first, then the submitted
  // job with the fewest.
  virtual std::optional<JobRecord> ClaimForBatch(
      const std::string& worker,
      int64_t lease_ms,
      const std::string& kind,
      const std::function<bool(const JobRecord&)>& accept) = 0;
  // Extends the lease and stores progress, seconds and warnings (cheap: not synced to disk).
  virtual HeartbeatReply Heartbeat(const Lease& lease,
                                   const ProgressRecord& progress,
                                   const JobUsage& usage,
                                   int64_t lease_ms) = 0;
  // Checks the lease (kAborted if it is lost) and for a request to cancel; writes nothing.
  virtual HeartbeatReply Peek(const Lease& lease) = 0;
  // Returns the checkpoint that this one replaces.
  virtual std::optional<FileDigest> SetCheckpoint(const Lease& lease, const FileDigest& blob) = 0;
  // Returns false if no other job does equal work now; later equal jobs will wait for this one.
  // Returns true if the job was put back, to be claimed when the other has ended, without counting
  // the attempt, or if it has ended as CANCELLED because cancellation was asked for.
  virtual bool JoinEqual(const Lease& lease, const std::string& stage_key) = 0;
  virtual void Publish(const Lease& lease, const Publication& publication) = 0;
  // kUnavailable and kAborted are tried again, with back-off, while attempts are left; kCancelled
  // ends as CANCELLED when cancellation was asked for.
  virtual void Fail(const Lease& lease, const JobError& error, const JobUsage& usage) = 0;
  // Puts the job back into the queue without counting the attempt (drain).
  virtual void Release(const Lease& lease, const JobUsage& usage) = 0;
  // The newest succeeded job with this key, with artifacts.
  virtual std::optional<JobRecord> FindStage(const std::string& stage_key) = 0;
  virtual void UpdateWorker(const WorkerRecord& worker) = 0;
};

}  // namespace color3d
