// A span as it is exported, after the data model of OpenTelemetry. Plain values.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/trace/trace_context.h"

namespace color3d {

// Values as in the protocol.
enum class SpanKind { kInternal = 1, kServer = 2, kClient = 3 };
enum class SpanStatus { kUnset = 0, kOk = 1, kError = 2 };

using AttributeValue = std::variant<std::string, int64_t, double, bool>;
using Attributes = std::vector<std::pair<std::string, AttributeValue>>;

struct Span {
  TraceContext context;
  std::string parent_id;  // empty: root of the trace
  std::string name;
  SpanKind kind = SpanKind::kInternal;
  int64_t start_ns = 0;  // nanoseconds since the Unix epoch
  int64_t end_ns = 0;
  Attributes attributes;
  SpanStatus status = SpanStatus::kUnset;
  std::string status_message;  // of an error
};

// Returns the present time, nanoseconds since the Unix epoch.
int64_t UnixNanoseconds();

}  // namespace color3d
