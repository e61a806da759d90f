// Trace of one command: its span is the root of those of server and workers, or part of the trace
// of whoever started the command (TRACEPARENT). Not thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/trace/tracer.h"

namespace color3d::client {

class CommandTrace {
 public:
  // Reads TRACEPARENT and the variables of trace_settings.h. `on_note` receives lines for the user.
  CommandTrace(const std::string& version, std::function<void(const std::string&)> on_note);

  // W3C traceparent to be sent with each call.
  std::string traceparent() const { return ToTraceparent(span_.context); }
  // Exports the span of the command if traces are exported; takes at most kLastSpansLimit.
  // `name`: without values, e.g. "color3d colorize".
  void End(const std::string& name, int exit_code);

 private:
  const std::function<void(const std::string&)> on_note_;
  std::shared_ptr<Tracer> tracer_;  // null: traces are not exported
  Span span_;
};

}  // namespace color3d::client
