// Spans as JSON of the OpenTelemetry protocol: https://opentelemetry.io/docs/specs/otlp. Stateless.
#pragma once

#include <string>
#include <vector>

#include "core/trace/span.h"

namespace color3d {

// The process that records spans.
struct TraceResource {
  std::string scope;  // instrumentation scope
  std::string version;
  Attributes attributes;  // "service.name" and others
};

// Returns an ExportTraceServiceRequest. Bytes that are not UTF-8 are replaced, attributes that are
// not finite are left out.
std::string ToOtlpJson(const TraceResource& resource, const std::vector<Span>& spans);

}  // namespace color3d
