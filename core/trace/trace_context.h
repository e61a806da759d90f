// Identity of a span and of its trace, as W3C "traceparent" carries it between processes:
// https://www.w3.org/TR/trace-context/. Plain values and stateless functions.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace color3d {

struct TraceContext {
  std::string trace_id;  // 32 lower-case hexadecimal digits, not all zero
  std::string span_id;   // 16 lower-case hexadecimal digits, not all zero
  bool sampled = false;  // spans of this trace are recorded
};

// Returns nothing if it is malformed or an id is all zeros.
std::optional<TraceContext> ParseTraceparent(std::string_view traceparent);
// "00-TRACE-SPAN-FLAGS".
std::string ToTraceparent(const TraceContext& context);
// Returns the trace id of a traceparent, or `text` itself if it is a trace id; empty for others.
std::string TraceIdOf(std::string_view text);

// Random ids.
std::string NewTraceId();
std::string NewSpanId();
// Returns the id of the span of a thing with this name, e.g. "jobs/ab12", in this trace: processes
// that know both agree on it.
std::string DerivedSpanId(const std::string& trace_id, const std::string& name);

}  // namespace color3d
