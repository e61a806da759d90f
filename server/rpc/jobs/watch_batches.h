// What happened to watched jobs, read once for all who watch the same and have seen as much.
// Thread-safe.
#pragma once

#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "server/store/job_store.h"
#include "server/store/project_store.h"

namespace color3d {

struct WatchBatch {
  bool all_finished = false;  // `events` are then the last ones, unless they are kMaxEvents
  std::vector<EventRecord> events;
  std::map<int64_t, JobRecord> progressed;  // by id
};

class WatchBatches {
 public:
  static constexpr int kMaxEvents = 64;

  explicit WatchBatches(JobStore& store) : store_(store) {}

  // The events of these jobs after that revision.
  std::shared_ptr<const WatchBatch> After(int64_t revision,
                                          const std::vector<int64_t>& ids,
                                          const ProjectStore& seen_by);
  // Something has happened since.
  void Forget();

 private:
  using Key = std::tuple<std::string, std::vector<int64_t>, int64_t>;  // project, jobs, revision
  using Batch = std::shared_ptr<const WatchBatch>;

  WatchBatch Read(int64_t revision,
                  const std::vector<int64_t>& ids,
                  const ProjectStore& seen_by) const;

  JobStore& store_;
  std::mutex mutex_;
  std::map<Key, std::shared_future<Batch>> batches_;
};

}  // namespace color3d
