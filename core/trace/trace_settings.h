// Which traces are exported where: the environment variables of OpenTelemetry,
// https://opentelemetry.io/docs/specs/otel/configuration/sdk-environment-variables. Plain values.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/trace/otlp_post.h"
#include "core/trace/span.h"

namespace color3d {

// OTEL_TRACES_SAMPLER.
struct TraceSampler {
  double ratio = 1.0;          // of the traces that it decides about
  bool follows_parent = true;  // takes the decision of the caller, if there is a caller

  // Decides about a new span of this trace; `parent`: of the caller, if there is one.
  bool Samples(const std::string& trace_id, const std::optional<TraceContext>& parent) const;
};

struct TraceSettings {
  TraceTarget target;  // no address: traces are not exported
  TraceSampler sampler;
  std::string service;    // "service.name"
  Attributes attributes;  // of OTEL_RESOURCE_ATTRIBUTES
  // About variables with values that are ignored, for the log.
  std::vector<std::string> warnings;
};

// Returns the value of an environment variable; empty if it is not set.
using GetVariable = std::function<std::string(const char* name)>;
std::string VariableOfProcess(const char* name);

// `service`: name unless OTEL_SERVICE_NAME is set. `endpoint`: address from the command line, which
// overrides the environment; may be empty. Throws Error{kInvalidArgument} for a malformed
// `endpoint`; malformed variables become warnings, as the specification has it.
TraceSettings ReadTraceSettings(const std::string& service,
                                const std::string& endpoint = "",
                                const GetVariable& get = VariableOfProcess);

// Throws Error{kInvalidArgument} unless it is http[s]://HOST[:PORT][/PATH]; `source` names it.
void CheckTraceEndpoint(const std::string& source, const std::string& url);

}  // namespace color3d
