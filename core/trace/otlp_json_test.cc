#include "core/trace/otlp_json.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace color3d {
namespace {

using Json = nlohmann::json;

Span ServerSpan() {
  Span span;
  span.context = {"5b8efff798038103d269b633813fc60c", "eee19b7ec3c1b174", true};
  span.parent_id = "eee19b7ec3c1b173";
  span.name = "I'm a server span";
  span.kind = SpanKind::kServer;
  span.start_ns = 1544712660000000000;
  span.end_ns = 1544712661000000000;
  span.attributes = {{"my.span.attr", "some value"}, {"my.number", int64_t{-7}}};
  return span;
}

// The example of the protocol (https://github.com/open-telemetry/opentelemetry-proto, "examples"),
// with integers as strings, which its mapping to JSON asks for.
TEST(OtlpJsonTest, MatchesExampleOfProtocol) {
  const TraceResource resource{"my.library", "1.0.0", {{"service.name", "my.service"}}};
  EXPECT_EQ(ToOtlpJson(resource, {ServerSpan()}),
            R"({"resourceSpans":[{"resource":{"attributes":[{"key":"service.name",)"
            R"("value":{"stringValue":"my.service"}}]},"scopeSpans":[{"scope":)"
            R"({"name":"my.library","version":"1.0.0"},"spans":[{)"
            R"("traceId":"5b8efff798038103d269b633813fc60c","spanId":"eee19b7ec3c1b174",)"
            R"("parentSpanId":"eee19b7ec3c1b173","name":"I'm a server span","kind":2,)"
            R"("startTimeUnixNano":"1544712660000000000","endTimeUnixNano":"1544712661000000000",)"
            R"("attributes":[{"key":"my.span.attr","value":{"stringValue":"some value"}},)"
            R"({"key":"my.number","value":{"intValue":"-7"}}]}]}]}]})");
}

TEST(OtlpJsonTest, WritesStatusAndKindsOfValues) {
  Span span = ServerSpan();
  span.parent_id.clear();
  span.attributes = {{"yes", true},
                     {"number", 0.5},
                     {"infinite", std::numeric_limits<double>::infinity()},
                     {"bytes", std::string("a\xff\n")}};
  span.status = SpanStatus::kError;
  span.status_message = "broken";
  const Json request = Json::parse(ToOtlpJson({"scope", "", {}}, {span, ServerSpan()}));
  const Json& spans = request.at("resourceSpans").at(0).at("scopeSpans").at(0).at("spans");
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_FALSE(spans[0].contains("parentSpanId"));
  EXPECT_EQ(spans[0].at("status"), (Json{{"code", 2}, {"message", "broken"}}));
  const Json& attributes = spans[0].at("attributes");
  ASSERT_EQ(attributes.size(), 3u) << attributes.dump();
  EXPECT_EQ(attributes[0].at("value"), (Json{{"boolValue", true}}));
  EXPECT_EQ(attributes[1].at("value"), (Json{{"doubleValue", 0.5}}));
  EXPECT_EQ(attributes[2].at("value"), (Json{{"stringValue", "a\xef\xbf\xbd\n"}}));
  EXPECT_FALSE(spans[1].contains("status"));
}

}  // namespace
}  // namespace color3d
