// Part of the job store that clients, workers and chores call. The database is the queue:
// at-least-once execution, exactly-once effects. A claim increments the lease epoch of the job;
// writes of a worker with an older epoch fail with Error{kAborted, LEASE_LOST}. All methods of all
// parts are thread-safe, may be called from several processes on one store, and are one transaction
// each. Errors: kNotFound, kFailedPrecondition (wrong state), kInvalidArgument (REQUEST_ID_REUSED),
// kUnavailable (store busy), kResourceExhausted (disk full).
#pragma once

#include <string>
#include <vector>

#include "server/store/job.h"

namespace color3d {

class CommonStore {
 public:
  virtual ~CommonStore() = default;

  virtual SceneRecord GetScene(const std::string& name) = 0;
  virtual JobRecord GetJob(const std::string& name) = 0;
  // Returns the jobs that this one depends on, with artifacts, in order of creation.
  virtual std::vector<JobRecord> GetInputs(int64_t job_id) = 0;
  // Returns the children of a job, with artifacts, in order of creation.
  virtual std::vector<JobRecord> ListChildren(const std::string& name) = 0;
  // Returns true if a job, scene or checkpoint names the blob.
  virtual bool IsReferenced(const std::string& sha256) = 0;
  virtual std::vector<WorkerRecord> ListWorkers() = 0;
  virtual void RemoveWorker(const std::string& worker_id) = 0;
};

}  // namespace color3d
