// The part of the job store that clients, workers and chores all call. The database is the queue:
// at-least-once execution, exactly-once effects. A claim raises the job's lease epoch, and every
// write of a worker is refused with Error{kAborted, LEASE_LOST} when its epoch is not the present
// one. All methods of all parts are thread-safe and may be called from several processes on one
// store; each is one transaction. Errors: kNotFound, kFailedPrecondition (wrong state),
// kInvalidArgument (REQUEST_ID_REUSED), kUnavailable (store busy), kResourceExhausted (disk full).
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
  // The jobs that this one depends on, in order of creation, with artifacts.
  virtual std::vector<JobRecord> GetInputs(int64_t job_id) = 0;
  // In order of creation, with artifacts.
  virtual std::vector<JobRecord> ListChildren(const std::string& name) = 0;
  // Returns true if a job, scene or checkpoint names the blob.
  virtual bool IsReferenced(const std::string& sha256) = 0;
  virtual std::vector<WorkerRecord> ListWorkers() = 0;
  virtual void RemoveWorker(const std::string& worker_id) = 0;
};

}  // namespace color3d
