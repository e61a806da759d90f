// Records spans of jobs: one from the creation of a job to its end, below the call or the job that
// created it, and one for each wait in the queue. Reads the events of the store, so that jobs count
// however they end. Attempts are recorded by workers (server/worker/attempt.cc).
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <thread>

#include "core/base/mutex.h"
#include "core/trace/tracer.h"
#include "server/store/client_store.h"

namespace color3d {

struct JobSpansOptions {
  std::chrono::milliseconds poll{250};
  // Returns true if this server, of all servers on the store, records.
  std::function<bool()> records = [] { return true; };
};

class JobSpans {
 public:
  // Begins with events after now. The store must outlive this object.
  JobSpans(ClientStore& store, std::shared_ptr<Tracer> tracer, JobSpansOptions options = {});
  // Records events up to now. A job that ends later has no span.
  ~JobSpans();
  JobSpans(const JobSpans&) = delete;
  JobSpans& operator=(const JobSpans&) = delete;

 private:
  void Loop();
  void Poll();
  void Record(const std::vector<EventRecord>& events);
  void RecordWait(const JobRecord& job, const TraceContext& call, const EventRecord& begin);
  void RecordJob(const JobRecord& job, const TraceContext& call, const EventRecord& end);

  ClientStore& store_;
  const std::shared_ptr<Tracer> tracer_;
  const JobSpansOptions options_;
  int64_t revision_ = 0;
  std::map<int64_t, int64_t> queued_since_ms_;  // by job
  Mutex mutex_;
  CondVar wake_;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last, because it uses the others
};

}  // namespace color3d
