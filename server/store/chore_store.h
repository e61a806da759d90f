// The part of the job store that chores call: expired leases, notifications, age limits, collection
// of blobs, backups (errors and threads: common_store.h).
#pragma once

#include <set>
#include <string>
#include <vector>

#include "server/store/common_store.h"

namespace color3d {

// A webhook call that is due because a job has ended.
struct Notification {
  int64_t job_id = 0;
  std::string job;
  std::string url;
  int tries = 0;
  int64_t first_ms = 0;  // when the job ended
};

// An unreferenced blob and when it was last touched.
struct BlobCandidate {
  std::string sha256;
  int64_t touched_ns = 0;
};

class ChoreStore : public virtual CommonStore {
 public:
  // Ends the attempts whose lease ran out; returns their number.
  virtual int ReapExpired() = 0;
  // Ends the leases of a worker known to be dead. Returns the names of its jobs.
  virtual std::vector<std::string> ExpireLeasesOf(const std::string& worker) = 0;
  // Returns true if another process keeps all others from writing for about a second.
  virtual bool IsHeld() = 0;
  // Returns true if writes are refused because the disk is full.
  virtual bool IsFull() = 0;
  // The epoch of the job's present lease; 0 if it is not running or does not exist.
  virtual int64_t RunningEpoch(const std::string& job_name) = 0;

  // The notifications that have been due for longest, at most `of_each_receiver` of one receiver
  // (scheme, host and port of the address), so that none keeps the others out.
  virtual std::vector<Notification> DueNotifications(int of_each_receiver) = 0;
  // Removes a notification that was delivered or given up. Does nothing if the job has ended anew
  // since `first_ms`: that is another notification.
  virtual void EndNotification(int64_t job_id, int64_t first_ms) = 0;
  // A pause is an hour at most.
  virtual void DelayNotification(int64_t job_id, int64_t first_ms, int64_t pause_ms) = 0;

  // First of two phases of deleting old jobs: notes submitted jobs that ended before this time, are
  // not pinned and are read by no unfinished job, and forgets those that are no longer so. Returns
  // the jobs noted for `grace_ms` by the steady clock.
  virtual std::vector<std::string> AgeExpired(int64_t ended_before_ms, int64_t grace_ms) = 0;
  // The same for scenes that were made and committed before `before_ms` and have no job, and for
  // those that were made before `uncommitted_before_ms` and were never committed.
  virtual std::vector<std::string> AgeUnusedScenes(int64_t before_ms,
                                                   int64_t uncommitted_before_ms,
                                                   int64_t grace_ms) = 0;
  // Deletes events of finished jobs from before `events_before_ms`, and request ids from before
  // both `requests_before_ms` and its value in a call a day ago by the steady clock.
  virtual void Compact(int64_t events_before_ms, int64_t requests_before_ms) = 0;

  // Digests of artifacts, scene files, checkpoints and blobs that specs name.
  virtual std::set<std::string> ReferencedBlobs() = 0;
  // Those of them that only uncommitted scenes name: their upload may never come.
  virtual std::set<std::string> AwaitedBlobs() = 0;
  // First of two phases of collection: notes unreferenced blobs, and forgets those that are not
  // given again. Returns the blobs that have been untouched, and this store open, for `grace_ms` by
  // the steady clock since they were first given.
  virtual std::vector<BlobCandidate> AgeCandidates(const std::vector<BlobCandidate>& unnamed,
                                                   int64_t grace_ms) = 0;
  // The blobs that it would return by its notes so far; writes nothing.
  virtual std::vector<BlobCandidate> AgedCandidates(int64_t grace_ms) = 0;
  // The blob was deleted: no project holds it any more, unless a job or scene names it by now.
  virtual void ForgetBlob(const std::string& sha256) = 0;
  // Returns free pages of the database beyond `keep_bytes` to the file system, some MiB a call.
  // Returns the number of bytes that are still free in it.
  virtual int64_t GiveBackSpace(int64_t keep_bytes) = 0;
};

}  // namespace color3d
