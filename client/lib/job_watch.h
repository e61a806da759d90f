// Follows jobs to their end with WatchJobs, across broken connections and server restarts.
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

// `on_event` receives every state change and progress of the jobs and their children, in order, on
// the calling thread; `keep_going` is called about five times a second. After a broken stream it
// resumes at the last revision seen. Throws RpcError; Error{kUnavailable} if the server is
// unreachable for 60 s.
WatchEnd WatchJobs(Connection& connection,
                   const std::vector<std::string>& names,
                   const std::function<void(const v1::JobEvent&)>& on_event,
                   const std::function<bool()>& keep_going);

// Returns the current state of a job.
v1::Job GetJob(Connection& connection, const std::string& name);
// Returns a scene. Throws RpcError if there is none of this name.
v1::Scene GetScene(Connection& connection, const std::string& name);
// Passes the jobs of a scene or of a job, of the whole server if `parent` is empty, the newest
// first, to `visit` until it returns false. Long specs are left out of them.
void ForEachJob(Connection& connection,
                const std::string& parent,
                const std::function<bool(const v1::Job&)>& visit);
// Cancels a job and returns it.
v1::Job CancelJob(Connection& connection, const std::string& name);
// Returns the jobs whose parent is `name`, oldest first.
std::vector<v1::Job> ListChildren(Connection& connection, const std::string& name);

bool IsFinished(v1::Job::State state);

}  // namespace color3d::client
