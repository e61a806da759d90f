#include "client/studio/queue/queue_calls.h"

#include <algorithm>
#include <functional>

#include "client/commands/follow.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/studio/run_progress.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace {

using Json = nlohmann::ordered_json;
constexpr int kMostRuns = 100;

// Whether a worker has done something for the run that the cache does not repeat at once.
bool HasBegun(const v1::Job& stage) {
  return stage.state() == v1::Job::STATE_RUNNING ||
         (stage.state() == v1::Job::STATE_SUCCEEDED && !stage.cached());
}

void Remove(Connection& connection, const std::string& job) {
  CancelJob(connection, job);
  v1::DeleteJobRequest remove;
  remove.set_name(job);
  remove.set_request_id(NewUuid());
  try {
    connection.Call(&v1::JobService::Stub::DeleteJob, connection.jobs(), remove);
  } catch (const RpcError&) {  // it has begun meanwhile, and ends at its next step
  }
}

}  // namespace

std::vector<std::string> OrderOfWaiting(const std::vector<std::string>& wanted,
                                        std::vector<std::string> waiting) {
  std::ranges::stable_sort(waiting, {}, [&](const std::string& id) {
    return std::ranges::find(wanted, id) - wanted.begin();
  });
  return waiting;
}

std::vector<QueueCalls::Run> QueueCalls::Unfinished(Connection& connection) const {
  std::vector<Run> runs;
  v1::ListJobsRequest request;
  request.set_page_size(500);
  do {
    const auto page = connection.Call(&v1::JobService::Stub::ListJobs, connection.jobs(), request);
    for (const v1::Job& job : page.jobs()) {
      const bool is_run = job.kind() == kind::kColorizeScene && job.parent().empty();
      if (is_run && !IsFinished(job.state()) && !job.cancel_requested()) runs.push_back({job});
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty() && runs.size() < kMostRuns);
  std::ranges::reverse(runs);  // the service lists the newest first
  for (Run& run : runs) {
    const std::vector<v1::Job> stages = ListChildren(connection, run.job.name());
    run.has_begun = std::ranges::any_of(stages, HasBegun);
  }
  std::stable_partition(runs.begin(), runs.end(), std::mem_fn(&Run::has_begun));
  return runs;
}

Json QueueCalls::List() const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  Json list = Json::array();
  for (const Run& run : Unfinished(connection)) {
    Json facts = JobFacts(run.job);
    facts["has_begun"] = run.has_begun;
    list.push_back(facts);
  }
  return list;
}

std::string QueueCalls::SubmitAgain(Connection& connection, const v1::Job& run) const {
  // Lists leave out long specs.
  const v1::Job whole = GetJob(connection, run.name());
  return SubmitJob(connection, whole.spec()).name();
}

Json QueueCalls::Reorder(const std::vector<std::string>& wanted) {
  const MutexLock one(reordering_);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  std::vector<Run> waiting = Unfinished(connection);
  std::erase_if(waiting, [](const Run& run) { return run.has_begun; });
  std::vector<std::string> present;
  for (const Run& run : waiting) present.push_back(IdOf(run.job.name()));
  const std::vector<std::string> order = OrderOfWaiting(wanted, present);
  size_t same = 0;
  while (same < order.size() && present[same] == order[same]) ++same;
  Json moved = Json::object();
  // Each is submitted before its former self is cancelled, so that a crash loses none.
  for (size_t i = same; i < order.size(); ++i) {
    const v1::Job& former = waiting[std::ranges::find(present, order[i]) - present.begin()].job;
    const std::string name = SubmitAgain(connection, former);
    {
      const MutexLock lock(mutex_);
      moved_[order[i]] = IdOf(name);
    }
    moved[order[i]] = IdOf(name);
    Remove(connection, former.name());
  }
  return moved;
}

std::string QueueCalls::MovedTo(const std::string& id) const {
  const MutexLock lock(mutex_);
  std::string now;
  for (auto next = moved_.find(id); next != moved_.end(); next = moved_.find(now)) {
    now = next->second;
  }
  return now;
}

}  // namespace color3d::client
