#include "server/rpc/jobs/watch_batches.h"

#include <exception>
#include <utility>

namespace color3d {
namespace {

constexpr size_t kMaxBatches = 64;  // that are kept

}  // namespace

std::shared_ptr<const WatchBatch> WatchBatches::After(int64_t revision,
                                                      const std::vector<int64_t>& ids,
                                                      const ProjectStore& seen_by) {
  std::promise<Batch> promise;
  std::shared_future<Batch> batch;
  bool is_ours = false;
  {
    std::lock_guard lock(mutex_);
    if (batches_.size() >= kMaxBatches) batches_.clear();
    std::shared_future<Batch>& known = batches_[{seen_by.project(), ids, revision}];
    is_ours = !known.valid();
    if (is_ours) known = promise.get_future().share();
    batch = known;
  }
  if (is_ours) {
    try {
      promise.set_value(std::make_shared<const WatchBatch>(Read(revision, ids, seen_by)));
    } catch (...) {
      promise.set_exception(std::current_exception());
      Forget();  // whoever asks later tries again
    }
  }
  return batch.get();
}

void WatchBatches::Forget() {
  std::lock_guard lock(mutex_);
  batches_.clear();
}

WatchBatch WatchBatches::Read(int64_t revision,
                              const std::vector<int64_t>& ids,
                              const ProjectStore& seen_by) const {
  WatchBatch batch;
  // Asked first: when all had finished before the events were read, those are complete.
  batch.all_finished = store_.AllFinished(ids);
  batch.events = store_.EventsSince(revision, ids, kMaxEvents);
  std::vector<int64_t> progressed;
  for (const EventRecord& event : batch.events) {
    if (event.kind == EventKind::kProgress) progressed.push_back(event.job_id);
  }
  if (progressed.empty()) return batch;
  for (JobRecord& job : seen_by.Snapshot(progressed).jobs) {
    const int64_t id = job.id;
    batch.progressed.emplace(id, std::move(job));
  }
  return batch;
}

}  // namespace color3d
