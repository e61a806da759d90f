#include "core/trace/otlp_json.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

namespace color3d {
namespace {

using Json = nlohmann::ordered_json;

// 64-bit integers are strings in JSON.
Json ToJson(const AttributeValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return {{"stringValue", *text}};
  if (const auto* number = std::get_if<int64_t>(&value)) {
    return {{"intValue", fmt::to_string(*number)}};
  }
  if (const auto* number = std::get_if<double>(&value)) return {{"doubleValue", *number}};
  return {{"boolValue", std::get<bool>(value)}};
}

Json ToJson(const Attributes& attributes) {
  Json list = Json::array();
  for (const auto& [name, value] : attributes) {
    const auto* number = std::get_if<double>(&value);
    if (number != nullptr && !std::isfinite(*number)) continue;
    list.push_back({{"key", name}, {"value", ToJson(value)}});
  }
  return list;
}

Json ToJson(const Span& span) {
  Json json = {{"traceId", span.context.trace_id}, {"spanId", span.context.span_id}};
  if (!span.parent_id.empty()) json["parentSpanId"] = span.parent_id;
  json["name"] = span.name;
  json["kind"] = static_cast<int>(span.kind);
  json["startTimeUnixNano"] = fmt::to_string(span.start_ns);
  json["endTimeUnixNano"] = fmt::to_string(span.end_ns);
  if (!span.attributes.empty()) json["attributes"] = ToJson(span.attributes);
  if (span.status != SpanStatus::kUnset) {
    json["status"]["code"] = static_cast<int>(span.status);
    if (!span.status_message.empty()) json["status"]["message"] = span.status_message;
  }
  return json;
}

}  // namespace

int64_t UnixNanoseconds() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string ToOtlpJson(const TraceResource& resource, const std::vector<Span>& spans) {
  Json list = Json::array();
  for (const Span& span : spans) list.push_back(ToJson(span));
  Json scope = {{"name", resource.scope}};
  if (!resource.version.empty()) scope["version"] = resource.version;
  const Json scope_spans = {{"scope", scope}, {"spans", list}};
  Json of_resource;
  of_resource["resource"]["attributes"] = ToJson(resource.attributes);
  of_resource["scopeSpans"] = Json::array({scope_spans});
  Json request;
  request["resourceSpans"] = Json::array({of_resource});
  return request.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace color3d
