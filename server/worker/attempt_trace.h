// Spans of one attempt at a job: the whole, below the span of the job, and its parts. Records
// nothing without a tracer, or if the call that made the job is not sampled. Thread-safe.
#pragma once

#include <string>

#include "core/base/mutex.h"
#include "core/trace/tracer.h"
#include "server/store/job.h"
#include "server/worker/lease_keeper.h"

namespace color3d {

class AttemptTrace {
 public:
  // `tracer` may be null, and must outlive this object.
  AttemptTrace(Tracer* tracer, const JobRecord& job);
  AttemptTrace(const AttemptTrace&) = delete;
  AttemptTrace& operator=(const AttemptTrace&) = delete;

  // W3C traceparent for calls of the stage: the attempt, or what is known of its caller; empty:
  // nothing.
  std::string traceparent() const;

  // Records a part of the attempt, from here to its destructor; as failed if an exception passes.
  class Part {
   public:
    Part(const AttemptTrace& attempt, const char* name);
    ~Part();
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;

   private:
    Tracer* const tracer_;  // null: not recorded
    const int exceptions_;
    Span span_;
  };

  template <typename Body>
  auto InPart(const char* name, const Body& body) const {
    const Part part(*this, name);
    return body();
  }

  // How the attempt ended, e.g. "succeeded"; the first one counts.
  void SetOutcome(const std::string& outcome);
  // The same for an attempt that was stopped, or failed with `error` (kNone).
  void SetOutcome(StopReason reason, const JobError& error);
  // Records the attempt, once.
  void End(const JobUsage& usage);
  // The same before the process ends: waits for spans to be sent.
  void EndProcess(const JobUsage& usage);

 private:
  Tracer* tracer_;  // null: not recorded
  const std::string given_;
  Mutex mutex_;
  Span span_ COLOR3D_GUARDED_BY(mutex_);
  bool ended_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::string outcome_ COLOR3D_GUARDED_BY(mutex_);
  TraceContext context_;  // of span_
};

}  // namespace color3d
