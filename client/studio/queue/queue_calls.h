// The runs that are not finished, in the order in which the service works on them. Thread-safe.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/studio/shared_connection.h"
#include "color3d/v1/job.pb.h"
#include "core/base/mutex.h"

namespace color3d::client {

// The IDs of `waiting` in the order of `wanted`; those that it does not name come last.
std::vector<std::string> OrderOfWaiting(const std::vector<std::string>& wanted,
                                        std::vector<std::string> waiting);

class QueueCalls {
 public:
  // `connection` must outlive the calls.
  explicit QueueCalls(SharedConnection& connection) : connection_(connection) {}

  // Facts of each run (JobFacts) with has_begun, first those that are worked on.
  nlohmann::ordered_json List() const;

  // Brings the runs that have not begun into this order (OrderOfWaiting). The service works in the
  // order of submission, so the runs from the first difference on are submitted again and the
  // earlier ones cancelled; what was computed for them is kept by the service. Returns
  // {old ID: new ID}.
  nlohmann::ordered_json Reorder(const std::vector<std::string>& wanted);

  // The ID of a run that was submitted again; "" if `id` was not.
  std::string MovedTo(const std::string& id) const;

 private:
  struct Run {
    v1::Job job;
    bool has_begun = false;
  };
  std::vector<Run> Unfinished(Connection& connection) const;
  std::string SubmitAgain(Connection& connection, const v1::Job& run) const;

  SharedConnection& connection_;
  mutable Mutex mutex_;
  Mutex reordering_;  // one at a time
  std::map<std::string, std::string> moved_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d::client
