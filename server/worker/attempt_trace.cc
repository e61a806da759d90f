#include "server/worker/attempt_trace.h"

#include <fmt/core.h>

#include <exception>
#include <utility>

namespace color3d {
namespace {

const char* OutcomeName(StopReason reason) {
  switch (reason) {
    case StopReason::kNone:
      return "failed";
    case StopReason::kCancelled:
      return "cancelled";
    case StopReason::kLeaseLost:
      return "lease lost";
    case StopReason::kDraining:
      return "released";
    case StopReason::kStuck:
      return "stuck";
  }
  return "unknown";
}

}  // namespace

AttemptTrace::AttemptTrace(Tracer* tracer, const JobRecord& job)
    : tracer_(tracer), given_(job.trace) {
  const std::optional<TraceContext> call = ParseTraceparent(job.trace);
  if (!call || !call->sampled) tracer_ = nullptr;
  if (tracer_ == nullptr) return;
  // The epoch is another one for each claim.
  const std::string name = fmt::format("{}/{}", job.name, job.lease_epoch);
  context_ = {call->trace_id, DerivedSpanId(call->trace_id, name), true};
  const MutexLock lock(mutex_);
  span_.context = context_;
  span_.parent_id = DerivedSpanId(call->trace_id, job.name);
  span_.name = "stage " + job.kind;
  span_.start_ns = UnixNanoseconds();
  span_.attributes = {{"color3d.job", job.name},
                      {"color3d.kind", job.kind},
                      {"color3d.attempt", int64_t{job.attempt}},
                      {"color3d.worker", job.worker},
                      {"color3d.queue_seconds", static_cast<double>(job.queued_ms) / 1e3}};
}

std::string AttemptTrace::traceparent() const {
  if (tracer_ != nullptr) return ToTraceparent(context_);
  if (ParseTraceparent(given_)) return given_;
  const std::string trace_id = TraceIdOf(given_);
  return trace_id.empty() ? "" : ToTraceparent({trace_id, NewSpanId(), true});
}

AttemptTrace::Part::Part(const AttemptTrace& attempt, const char* name)
    : tracer_(attempt.tracer_), exceptions_(std::uncaught_exceptions()) {
  if (tracer_ == nullptr) return;
  span_.context = {attempt.context_.trace_id, NewSpanId(), true};
  span_.parent_id = attempt.context_.span_id;
  span_.name = name;
  span_.start_ns = UnixNanoseconds();
}

AttemptTrace::Part::~Part() {
  if (tracer_ == nullptr) return;
  span_.end_ns = UnixNanoseconds();
  if (std::uncaught_exceptions() > exceptions_) span_.status = SpanStatus::kError;
  tracer_->Record(std::move(span_));
}

void AttemptTrace::SetOutcome(const std::string& outcome) {
  const MutexLock lock(mutex_);
  if (outcome_.empty()) outcome_ = outcome;
}

void AttemptTrace::SetOutcome(StopReason reason, const JobError& error) {
  const MutexLock lock(mutex_);
  if (!outcome_.empty()) return;
  outcome_ = OutcomeName(reason);
  if (reason != StopReason::kNone) return;
  span_.status = SpanStatus::kError;
  span_.status_message = error.message;
  span_.attributes.emplace_back("error.type",
                                error.reason.empty() ? ErrorCodeName(error.code) : error.reason);
}

void AttemptTrace::End(const JobUsage& usage) {
  if (tracer_ == nullptr) return;
  const MutexLock lock(mutex_);
  if (std::exchange(ended_, true)) return;
  span_.end_ns = UnixNanoseconds();
  span_.attributes.emplace_back("color3d.outcome", outcome_.empty() ? "unknown" : outcome_);
  span_.attributes.emplace_back("color3d.cached", outcome_ == "cached");
  span_.attributes.emplace_back("color3d.peak_memory_bytes", usage.peak_memory_bytes);
  tracer_->Record(span_);
}

void AttemptTrace::EndProcess(const JobUsage& usage) {
  End(usage);
  if (tracer_ != nullptr) tracer_->Flush();
}

}  // namespace color3d
