#include "client/lib/command_trace.h"

#include <utility>

namespace color3d::client {

CommandTrace::CommandTrace(const std::string& version,
                           std::function<void(const std::string&)> on_note)
    : on_note_(std::move(on_note)) {
  const TraceSettings settings = ReadTraceSettings("color3d");
  for (const std::string& warning : settings.warnings) on_note_(warning);
  tracer_ = Tracer::Make(settings, version, on_note_);
  const std::optional<TraceContext> parent = ParseTraceparent(VariableOfProcess("TRACEPARENT"));
  if (tracer_) {
    span_.context = tracer_->Begin(parent);
    if (parent) span_.parent_id = parent->span_id;
  } else {
    span_.context = parent ? *parent : TraceContext{NewTraceId(), NewSpanId(), true};
  }
  // Whoever is not recorded names the recorded one above it.
  if (parent && !span_.context.sampled) span_.context.span_id = parent->span_id;
  span_.start_ns = UnixNanoseconds();
}

void CommandTrace::End(const std::string& name, int exit_code) {
  if (!tracer_ || !span_.context.sampled) return;
  span_.name = name;
  span_.end_ns = UnixNanoseconds();
  span_.attributes = {{"process.exit.code", int64_t{exit_code}}, {"color3d.command", name}};
  if (exit_code != 0) {
    span_.status = SpanStatus::kError;
    span_.status_message = "exit code " + std::to_string(exit_code);
  }
  tracer_->Record(span_);
  if (!tracer_->Flush()) on_note_("the collector of traces did not answer in time");
}

}  // namespace color3d::client
