#include "server/tracing/job_spans.h"

#include <spdlog/spdlog.h>

#include <set>
#include <utility>
#include <vector>

namespace color3d {
namespace {

constexpr int kEventsAtOnce = 500;
// Of jobs in the queue; a longer queue loses waits, no jobs.
constexpr size_t kMaxWaits = 200'000;
constexpr int64_t kNsPerMs = 1'000'000;

// Called for spans of jobs and of their waits.
Attributes AttributesOf(const JobRecord& job) {
  Attributes attributes = {{"color3d.job", job.name},
                           {"color3d.kind", job.kind},
                           {"color3d.scene", PublicScene(job.scene)}};
  if (!job.project.empty()) attributes.emplace_back("color3d.project", job.project);
  return attributes;
}

}  // namespace

JobSpans::JobSpans(ClientStore& store, std::shared_ptr<Tracer> tracer, JobSpansOptions options)
    : store_(store),
      tracer_(std::move(tracer)),
      options_(std::move(options)),
      revision_(store.NewestRevision()) {
  thread_ = std::thread([this] { Loop(); });
}

JobSpans::~JobSpans() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.NotifyAll();
  thread_.join();
}

void JobSpans::Loop() {
  auto next_complaint = std::chrono::steady_clock::now();
  for (bool last = false; !last;) {
    {
      MutexLock lock(mutex_);
      const auto end = std::chrono::steady_clock::now() + options_.poll;
      while (!stopping_ && wake_.WaitUntil(mutex_, end)) continue;
      last = stopping_;
    }
    try {
      Poll();
    } catch (const std::exception& e) {
      if (std::chrono::steady_clock::now() < next_complaint) continue;
      next_complaint = std::chrono::steady_clock::now() + std::chrono::minutes(1);
      spdlog::warn("cannot read job events for traces: {}", e.what());
    }
  }
}

void JobSpans::Poll() {
  while (true) {
    const std::vector<EventRecord> events = store_.EventsSince(revision_, kEventsAtOnce);
    if (options_.records()) {
      Record(events);
    } else {
      queued_since_ms_.clear();
    }
    if (!events.empty()) revision_ = events.back().revision;
    if (events.size() < kEventsAtOnce) return;
  }
}

void JobSpans::Record(const std::vector<EventRecord>& events) {
  std::set<int64_t> ids;
  for (const EventRecord& event : events) {
    const bool begins =
        event.state == JobState::kRunning && queued_since_ms_.contains(event.job_id);
    if (event.kind == EventKind::kState &&
        (begins || event.state == JobState::kQueued || IsFinished(event.state))) {
      ids.insert(event.job_id);
    }
  }
  if (ids.empty()) return;
  std::map<int64_t, JobRecord> jobs;
  for (JobRecord& job : store_.Snapshot({ids.begin(), ids.end()}).jobs) {
    const int64_t id = job.id;
    jobs.emplace(id, std::move(job));
  }
  for (const EventRecord& event : events) {
    if (event.kind != EventKind::kState) continue;
    const auto job = jobs.find(event.job_id);
    if (job == jobs.end()) continue;  // deleted
    const std::optional<TraceContext> call = ParseTraceparent(job->second.trace);
    if (!call || !call->sampled) continue;
    if (event.state == JobState::kQueued) {
      if (queued_since_ms_.size() >= kMaxWaits) queued_since_ms_.clear();
      queued_since_ms_[event.job_id] = event.time_ms;
    } else if (event.state == JobState::kRunning) {
      RecordWait(job->second, *call, event);
    } else if (IsFinished(event.state)) {
      RecordJob(job->second, *call, event);
    }
    if (event.state != JobState::kQueued) queued_since_ms_.erase(event.job_id);
  }
}

void JobSpans::RecordWait(const JobRecord& job,
                          const TraceContext& call,
                          const EventRecord& begin) {
  const auto since = queued_since_ms_.find(job.id);
  if (since == queued_since_ms_.end()) return;
  Span span;
  span.context = {call.trace_id, NewSpanId(), call.sampled};
  span.parent_id = DerivedSpanId(call.trace_id, job.name);
  span.name = "queue";
  span.start_ns = since->second * kNsPerMs;
  span.end_ns = begin.time_ms * kNsPerMs;
  span.attributes = AttributesOf(job);
  span.attributes.emplace_back("color3d.attempt", int64_t{begin.attempt});
  tracer_->Record(std::move(span));
}

void JobSpans::RecordJob(const JobRecord& job, const TraceContext& call, const EventRecord& end) {
  Span span;
  span.context = {call.trace_id, DerivedSpanId(call.trace_id, job.name), call.sampled};
  span.parent_id = job.parent.empty() ? call.span_id : DerivedSpanId(call.trace_id, job.parent);
  span.name = "job " + job.kind;
  span.start_ns = job.create_ms * kNsPerMs;
  span.end_ns = end.time_ms * kNsPerMs;
  span.attributes = AttributesOf(job);
  span.attributes.emplace_back("color3d.state", JobStateName(end.state));
  span.attributes.emplace_back("color3d.attempts", int64_t{end.attempt});
  span.attributes.emplace_back("color3d.cached", job.cached);
  span.attributes.emplace_back("color3d.queue_seconds", static_cast<double>(job.queued_ms) / 1e3);
  if (end.state == JobState::kFailed) {
    span.status = SpanStatus::kError;
    if (job.error) {
      span.status_message = job.error->message;
      span.attributes.emplace_back("error.type", job.error->reason);
    }
  }
  if (!job.skip_reason.empty()) span.attributes.emplace_back("color3d.skipped", job.skip_reason);
  tracer_->Record(std::move(span));
}

}  // namespace color3d
