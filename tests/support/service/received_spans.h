// Spans that a collector of traces has received (http_receiver.h), for tests.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/service/http_receiver.h"

namespace color3d::testing {

struct ReceivedSpan {
  std::string trace, id, parent, name, service, error;
  int kind = 0;
  int64_t start_ns = 0, end_ns = 0;
  std::map<std::string, std::string> attributes;  // as JSON text
};

inline std::vector<ReceivedSpan> SpansOf(HttpReceiver& collector) {
  std::vector<ReceivedSpan> spans;
  for (const HttpReceiver::Request& request : collector.requests()) {
    const nlohmann::json body = nlohmann::json::parse(request.body);
    for (const auto& resource : body.at("resourceSpans")) {
      std::string service;
      for (const auto& entry : resource.at("resource").at("attributes")) {
        if (entry.at("key") == "service.name") service = entry.at("value").at("stringValue");
      }
      for (const auto& json : resource.at("scopeSpans").at(0).at("spans")) {
        ReceivedSpan span;
        span.trace = json.at("traceId");
        span.id = json.at("spanId");
        span.parent = json.value("parentSpanId", "");
        span.name = json.at("name");
        span.service = service;
        span.kind = json.at("kind");
        span.start_ns = std::stoll(json.at("startTimeUnixNano").get<std::string>());
        span.end_ns = std::stoll(json.at("endTimeUnixNano").get<std::string>());
        if (json.contains("status")) span.error = json.at("status").value("message", "error");
        for (const auto& entry : json.value("attributes", nlohmann::json::array())) {
          const nlohmann::json value = entry.at("value").front();
          span.attributes[entry.at("key")] =
              value.is_string() ? value.get<std::string>() : value.dump();
        }
        spans.push_back(span);
      }
    }
  }
  return spans;
}

// Spans of this name.
inline std::vector<ReceivedSpan> SpansNamed(const std::vector<ReceivedSpan>& spans,
                                            const std::string& name) {
  std::vector<ReceivedSpan> found;
  for (const ReceivedSpan& span : spans) {
    if (span.name == name) found.push_back(span);
  }
  return found;
}

}  // namespace color3d::testing
