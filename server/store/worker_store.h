// Part of the job store that workers call. All writes are fenced by the lease (common_store.h).
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
  std::string stage_key;  // empty: later equal jobs do not find the results
  bool cached = false;
  JobUsage usage;
};

// Returns whether the worker takes the job.
using JobChoice = std::function<bool(const JobRecord&)>;

class WorkerStore : public virtual CommonStore {
 public:
  // Claims the next job unless the queue is held: smallest priority first, then the project that
  // has waited longest since its last turn.
  virtual std::optional<JobRecord> Claim(const std::string& worker, int64_t lease_ms) = 0;
  // The same, without the jobs that `accept` rejects. `accept` may be called twice for a job.
  virtual std::optional<JobRecord> ClaimAccepted(const std::string& worker,
                                                 int64_t lease_ms,
                                                 const JobChoice& accept) = 0;
  // Claims a job of this kind to run beside those that the worker already holds. Skips jobs that
  // have lost a worker, jobs behind a waiting job of another kind, and jobs that `accept` rejects.
  // Prefers the project, then the submitted job, with the fewest running jobs.
  virtual std::optional<JobRecord> ClaimForBatch(const std::string& worker,
                                                 int64_t lease_ms,
                                                 const std::string& kind,
                                                 const JobChoice& accept) = 0;
  // Extends the lease and stores progress, seconds and warnings. Cheap: not synced to disk.
  virtual HeartbeatReply Heartbeat(const Lease& lease,
                                   const ProgressRecord& progress,
                                   const JobUsage& usage,
                                   int64_t lease_ms) = 0;
  // Checks the lease (kAborted if it is lost) and for a cancellation request; writes nothing.
  virtual HeartbeatReply Peek(const Lease& lease) = 0;
  // Returns the replaced checkpoint.
  virtual std::optional<FileDigest> SetCheckpoint(const Lease& lease, const FileDigest& blob) = 0;
  // Returns false if no running job does equal work; later equal jobs then wait for this one.
  // Returns true if the job was requeued until the other job ends, without counting the attempt, or
  // has ended as CANCELLED because cancellation was requested.
  virtual bool JoinEqual(const Lease& lease, const std::string& stage_key) = 0;
  virtual void Publish(const Lease& lease, const Publication& publication) = 0;
  // Ends the attempt with an error. kUnavailable and kAborted are retried with back-off while
  // attempts are left; kCancelled ends the job as CANCELLED if cancellation was requested.
  virtual void Fail(const Lease& lease, const JobError& error, const JobUsage& usage) = 0;
  // Requeues the job without counting the attempt (drain).
  virtual void Release(const Lease& lease, const JobUsage& usage) = 0;
  // Returns the newest succeeded job with this key, with artifacts.
  virtual std::optional<JobRecord> FindStage(const std::string& stage_key) = 0;
  virtual void UpdateWorker(const WorkerRecord& worker) = 0;
};

}  // namespace color3d
