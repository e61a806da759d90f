// Part of the job store that workers call. All writes are fenced by the lease (common_store.h).
#pragma once

#include <cstdint>
#include <optional>
#include <set>
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

// Call of a worker for a job.
struct ClaimTerms {
  std::string worker;
  int64_t lease_ms = 0;
  // Memory that its jobs may take; 0: unknown. Jobs that need more are left to workers with more,
  // if there are any.
  int64_t memory_limit_bytes = 0;
  // Weights and model servers that the worker has, as in JobNeeds; unset: all that jobs may need.
  std::optional<std::set<std::string>> models;
  // Not empty: a job of this kind and group, to run beside those that the worker already holds.
  // Skips jobs that have lost a worker and jobs behind a waiting job of another kind.
  std::string batch_kind;
  std::string batch_group;
};

class WorkerStore : public virtual CommonStore {
 public:
  // Claims the next job that the worker can run, unless the queue is held: smallest priority first,
  // then the project that has used least of its share, then the earliest deadline; for a batch the
  // project, then the submitted job, with the fewest running jobs. A job that prefers another
  // worker is left to it for some seconds.
  virtual std::optional<JobRecord> Claim(const ClaimTerms& terms) = 0;
  std::optional<JobRecord> Claim(const std::string& worker, int64_t lease_ms) {
    return Claim(ClaimTerms{.worker = worker, .lease_ms = lease_ms});
  }
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
