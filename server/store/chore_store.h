// Part of the job store that chores call: expired leases, notifications, age limits, collection of
// blobs, backups. Errors and thread safety: common_store.h.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "server/store/common_store.h"

namespace color3d {

// A due webhook call about a finished job.
struct Notification {
  int64_t job_id = 0;
  std::string job;
  std::string url;
  int tries = 0;
  int64_t first_ms = 0;  // time when the job ended
};

// An unreferenced blob and when it was last touched.
struct BlobCandidate {
  std::string sha256;
  int64_t touched_ns = 0;
};

class ChoreStore : public virtual CommonStore {
 public:
  // Ends attempts with expired leases; returns their number.
  virtual int ReapExpired() = 0;
  // Ends the leases of a dead worker. Returns the names of its jobs.
  virtual std::vector<std::string> ExpireLeases(const std::string& worker) = 0;
  // Returns true if writes fail because the disk is full.
  virtual bool IsFull() = 0;
  // Returns the lease epoch of a running job; 0 if it is not running or does not exist.
  virtual int64_t RunningEpoch(const std::string& job_name) = 0;

  // Returns the notifications that have been due longest, at most `of_each_receiver` for each
  // receiver (scheme, host and port), so that none delays the others.
  virtual std::vector<Notification> DueNotifications(int of_each_receiver) = 0;
  // Removes a notification that was delivered or given up. Does nothing if the job has ended again
  // since `first_ms`, which is another notification.
  virtual void EndNotification(int64_t job_id, int64_t first_ms) = 0;
  // Requires: the pause is at most an hour.
  virtual void DelayNotification(int64_t job_id, int64_t first_ms, int64_t pause_ms) = 0;

  // First of two phases of deleting old jobs: marks submitted jobs that ended before this time, are
  // not pinned and are not inputs of unfinished jobs; unmarks all others. Returns jobs that have
  // been marked for `grace_ms` of the steady clock.
  virtual std::vector<std::string> AgeExpired(int64_t ended_before_ms, int64_t grace_ms) = 0;
  // The same for scenes without jobs that were created and committed before `before_ms`, and for
  // uncommitted scenes created before `uncommitted_before_ms`.
  virtual std::vector<std::string> AgeUnusedScenes(int64_t before_ms,
                                                   int64_t uncommitted_before_ms,
                                                   int64_t grace_ms) = 0;
  // Deletes events of finished jobs older than `events_before_ms`, and request ids older than both
  // `requests_before_ms` and its value in a call a day ago (steady clock).
  virtual void Compact(int64_t events_before_ms, int64_t requests_before_ms) = 0;

  // Returns digests of artifacts, scene files, checkpoints and blobs in specs.
  virtual std::set<std::string> ReferencedBlobs() = 0;
  // Returns referenced digests that only uncommitted scenes name; they may never be uploaded.
  virtual std::set<std::string> AwaitedBlobs() = 0;
  // First of two phases of collection: marks the given unreferenced blobs and unmarks all others.
  // Returns blobs that have been marked and untouched for `grace_ms` of the steady clock while this
  // store was open.
  virtual std::vector<BlobCandidate> AgeCandidates(const std::vector<BlobCandidate>& unnamed,
                                                   int64_t grace_ms) = 0;
  // Returns the blobs that AgeCandidates would return by the present marks; writes nothing.
  virtual std::vector<BlobCandidate> AgedCandidates(int64_t grace_ms) = 0;
  // Called after the blob was deleted: no project holds it any more, unless a job or scene names it
  // by now.
  virtual void ForgetBlob(const std::string& sha256) = 0;
  // Returns free pages of the database beyond `keep_bytes` to the file system, some MiB per call.
  // Returns the number of bytes still free in it.
  virtual int64_t ReturnFreeSpace(int64_t keep_bytes) = 0;
};

}  // namespace color3d
