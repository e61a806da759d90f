// Follows jobs to their end over WatchJobs, through broken connections and server restarts.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

enum class WatchEnd {
  kFinished,  // every watched job has ended
  kStopped,   // `keep_going` returned false
};

// `on_event` gets every state change and progress of the jobs and of their children, in order, on
// the calling thread; `keep_going` is asked about five times a second. A broken stream resumes at
// the last revision seen. Throws RpcError; Error{kUnavailable} when the server stays away for 60 s.
WatchEnd WatchJobs(Connection& connection,
                   const std::vector<std::string>& names,
                   const std::function<void(const v1::JobEvent&)>& on_event,
                   const std::function<bool()>& keep_going);

// Fresh state.
v1::Job GetJob(Connection& connection, const std::string& name);
// The jobs whose parent `name` is, oldest first.
std::vector<v1::Job> ListChildren(Connection& connection, const std::string& name);

bool IsFinished(v1::Job::State state);

}  // namespace color3d::client
