// WatchJobs streams. One thread polls the store's event table for all of them; a stream keeps only
// its position in that table, so a slow reader costs bounded memory and loses no state change.
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "color3d/v1/job.grpc.pb.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/jobs/watch_batches.h"

namespace color3d {

class JobWatcher;

struct WatchTiming {
  std::chrono::milliseconds poll{100};
  std::chrono::milliseconds keepalive{30'000};
};

class WatchHub {
 public:
  WatchHub(const RpcParts& parts, WatchTiming timing);
  // Ends all streams (UNAVAILABLE) and stops polling. Before the executor is destroyed.
  ~WatchHub();
  WatchHub(const WatchHub&) = delete;
  WatchHub& operator=(const WatchHub&) = delete;

  grpc::ServerWriteReactor<v1::JobEvent>* Watch(const grpc::CallbackServerContext& context,
                                                const v1::WatchJobsRequest& request);
  // Ends all streams, present and future, with UNAVAILABLE (DRAINING).
  void Drain();

 private:
  friend class JobWatcher;
  void Loop();
  void Poll();
  void Register(const std::shared_ptr<JobWatcher>& watcher);
  void Unregister(JobWatcher* watcher);

  const RpcParts& parts_;
  const WatchTiming timing_;
  WatchBatches batches_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  bool draining_ = false;
  std::map<JobWatcher*, std::shared_ptr<JobWatcher>> watchers_;
  int64_t revision_ = 0;  // poller only
  std::thread thread_;
};

}  // namespace color3d
