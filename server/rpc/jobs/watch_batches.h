// Cache of events of watched jobs, shared by watchers of the same jobs at the same revision.
// Thread-safe.
#pragma once

#include <future>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "core/base/mutex.h"
#include "server/store/client_store.h"
#include "server/store/project_store.h"

namespace color3d {

struct WatchBatch {
  bool all_finished = false;  // `events` are then the last ones, unless there are kMaxEvents
  std::vector<EventRecord> events;
  std::map<int64_t, JobRecord> progressed;  // by id
};

class WatchBatches {
 public:
  static constexpr int kMaxEvents = 64;

  explicit WatchBatches(ClientStore& store) : store_(store) {}

  // Returns the events of these jobs after `revision`.
  std::shared_ptr<const WatchBatch> After(int64_t revision,
                                          const std::vector<int64_t>& ids,
                                          const ProjectStore& seen_by);
  // Clears the cache: there are new events.
  void Forget();

 private:
  using Key = std::tuple<std::string, std::vector<int64_t>, int64_t>;  // project, jobs, revision
  using Batch = std::shared_ptr<const WatchBatch>;

  WatchBatch Read(int64_t revision,
                  const std::vector<int64_t>& ids,
                  const ProjectStore& seen_by) const;

  ClientStore& store_;
  Mutex mutex_;
  std::map<Key, std::shared_future<Batch>> batches_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
