// The server's chores, on a thread of its own: expired leases, dead uploads, unreferenced blobs,
// left-over scratch folders, old events.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "server/storage/blob_store.h"
#include "server/storage/data_folder.h"
#include "server/storage/upload_store.h"
#include "server/store/job_store.h"

namespace color3d {

struct MaintenanceTiming {
  std::chrono::milliseconds reap{5'000};
  std::chrono::hours sweep{24};
  std::chrono::seconds grace{24 * 3600};    // of unreferenced blobs and dead uploads
  std::chrono::hours keep_events{30 * 24};  // after the job's end
  std::chrono::hours keep_request_ids{7 * 24};
};

class Maintenance {
 public:
  // Sweeps once at once, then every `sweep`. `store` is used from the chore thread.
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
  void Loop();
  void Sweep();
  void SweepScratch();

  JobStore& store_;
  BlobStore& blobs_;
  UploadStore& uploads_;
  const DataPaths paths_;
  const Clock clock_;
  const MaintenanceTiming timing_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::thread thread_;
};

// Leases of worker processes that are gone (the whole machine or the server was killed) end now.
void ExpireDeadWorkers(JobStore& store);

}  // namespace color3d
