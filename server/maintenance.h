// Periodic chores of the server. Leases are checked on a thread of their own, so that slow chores
// do not delay lost jobs.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "server/storage/ballast.h"
#include "server/storage/blob_store.h"
#include "server/storage/data_folder.h"
#include "server/storage/upload_store.h"
#include "server/store/job_store.h"

namespace color3d {

struct MaintenanceTiming {
  std::chrono::milliseconds reap{5'000};
  std::chrono::milliseconds sweep{3600 * 1000};
  std::chrono::milliseconds sweep_again{60'000};  // after a failed sweep
  std::chrono::seconds grace{24 * 3600};          // for unreferenced blobs and dead uploads
  std::chrono::hours keep_events{30 * 24};        // after the job's end
  std::chrono::hours keep_request_ids{7 * 24};
  std::chrono::hours keep_jobs{0};              // after their end, unless pinned; 0: forever
  std::chrono::hours keep_uncommitted{7 * 24};  // scenes, after their creation; 0: forever
  int64_t low_space_bytes = 0;  // no job starts below this free space, until a tenth more is free
  int64_t scrub_bytes = int64_t{2} << 30;  // verified in each sweep
  int64_t keep_free_rows_bytes =
      int64_t{4} << 20;  // free space in the database; more is returned to the file system
  // Workers of other machines are no longer listed after this time without a report.
  std::chrono::milliseconds forget_workers{180'000};
  std::function<void()> on_life = {};  // called at each `reap` if the store is readable
  // Created while more than `reserve_bytes` are free, released if a deletion needs the space.
  Ballast* ballast = nullptr;
  int64_t reserve_bytes = 0;
  // Returns true if this server, of all servers on the store, collects blobs, expires jobs and
  // pauses the queue.
  std::function<bool()> has_chores = [] { return true; };
};

// Sets damaged blobs aside, so that an upload or another run replaces them. Cycles through all
// blobs in the order of their digests. Not thread-safe.
class Scrubber {
 public:
  explicit Scrubber(BlobStore& blobs) : blobs_(blobs) {}
  struct Result {
    int64_t bytes = 0;
    std::vector<std::string> damaged;
    std::vector<std::string> unreadable;  // "DIGEST: REASON"
  };
  // Continues after the last blob of the previous call, for about `bytes` bytes or until `stop`
  // returns true. Requires: `blobs` has all blobs.
  Result Scrub(std::vector<StoredBlob> blobs, int64_t bytes, const std::function<bool()>& stop);

 private:
  BlobStore& blobs_;
  std::string last_;
};

// Counts since the start.
struct ChoreCounts {
  std::atomic<int64_t> attempts_lost{0};
  std::atomic<int64_t> blobs_removed{0};
  std::atomic<int64_t> jobs_expired{0};
  std::atomic<int64_t> sweeps_failed{0};
};

class Maintenance {
 public:
  const ChoreCounts& counts() const { return counts_; }

  // Sweeps at once, then every `sweep`, or every `sweep_again` while it has no chores. The
  // arguments must outlive this object.
  Maintenance(JobStore& store,
              BlobStore& blobs,
              UploadStore& uploads,
              const DataPaths& paths,
              const Clock& clock,
              const MaintenanceTiming& timing);
  ~Maintenance();
  Maintenance(const Maintenance&) = delete;
  Maintenance& operator=(const Maintenance&) = delete;

 private:
  // Repeats the chore, waiting for the time that it returns, until the destructor.
  void Repeat(const std::function<std::chrono::milliseconds()>& chore);
  std::chrono::milliseconds Reap();
  std::chrono::milliseconds Sweep();
  // The part that one of all servers does.
  void SweepForAll(std::vector<std::string>* unreadable);
  void PauseWhenSpaceIsLow();
  void ReturnFreeSpace();
  void ForgetLostWorkers();
  void CollectBlobs(const std::vector<StoredBlob>& blobs);
  void ExpireJobs();
  // Adds the paths that could not be read to `unreadable`.
  void SweepScratch(std::vector<std::string>* unreadable);
  void SweepJobLogs(std::vector<std::string>* unreadable);
  void Scrub(const std::vector<StoredBlob>& blobs, std::vector<std::string>* unreadable);
  bool IsStopping();

  JobStore& store_;
  BlobStore& blobs_;
  UploadStore& uploads_;
  const DataPaths paths_;
  const Clock clock_;
  const MaintenanceTiming timing_;
  Scrubber scrubber_;
  std::chrono::steady_clock::time_point next_scrub_{};
  struct Report {
    int64_t at_ms = 0;  // as recorded
    std::chrono::steady_clock::time_point seen;
  };
  std::map<std::string, Report> reports_;  // of workers on other machines; reaper's thread only
  ChoreCounts counts_;
  Mutex mutex_;
  CondVar wake_;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread reaper_, sweeper_;
};

// Ends the leases of worker processes that no longer exist, after a kill of the machine or server.
void ExpireDeadWorkers(ChoreStore& store);

}  // namespace color3d
