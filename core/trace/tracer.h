// Records the spans of a process. Thread-safe; recording never blocks and never fails.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/trace/span.h"
#include "core/trace/span_exporter.h"
#include "core/trace/trace_settings.h"

namespace color3d {

// Time that a process waits at its end for its last spans to be sent.
inline constexpr std::chrono::milliseconds kLastSpansLimit{1'000};

class Tracer {
 public:
  // Returns null if the settings export no traces. `version`: of the program. `on_problem` receives
  // lines for the log, also from another thread.
  static std::shared_ptr<Tracer> Make(const TraceSettings& settings,
                                      const std::string& version,
                                      std::function<void(const std::string&)> on_problem);

  // Returns the context of a new span below `parent`, or of the root of a new trace.
  TraceContext Begin(const std::optional<TraceContext>& parent) const;
  // Ignores spans that are not sampled.
  void Record(Span span);
  bool Flush(std::chrono::milliseconds limit = kLastSpansLimit) { return exporter_.Flush(limit); }
  SpanExporter::Counts counts() const { return exporter_.counts(); }

 private:
  Tracer(const TraceSampler& sampler, ExporterOptions options)
      : sampler_(sampler), exporter_(std::move(options)) {}

  const TraceSampler sampler_;
  SpanExporter exporter_;
};

}  // namespace color3d
