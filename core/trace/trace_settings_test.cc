#include "core/trace/trace_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "core/base/error.h"

namespace color3d {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;
using Variables = std::map<std::string, std::string>;

TraceSettings Read(const Variables& variables, const std::string& endpoint = "") {
  return ReadTraceSettings("color3d-test", endpoint, [&](const char* name) {
    const auto value = variables.find(name);
    return value == variables.end() ? std::string() : value->second;
  });
}

TEST(TraceSettingsTest, ExportsNothingWithoutAddress) {
  EXPECT_EQ(Read({}).target.url, "");
  EXPECT_EQ(Read({{"OTEL_SERVICE_NAME", "other"}}).target.url, "");
  const Variables on = {{"OTEL_EXPORTER_OTLP_ENDPOINT", "http://c:4318"},
                        {"OTEL_SDK_DISABLED", "True"}};
  EXPECT_EQ(Read(on).target.url, "");
  EXPECT_EQ(Read(on, "http://c:4318").target.url, "");
  EXPECT_EQ(
      Read({{"OTEL_EXPORTER_OTLP_ENDPOINT", "http://c:4318"}, {"OTEL_TRACES_EXPORTER", "none"}})
          .target.url,
      "");
}

// "Endpoint URLs for OTLP/HTTP" of the specification.
TEST(TraceSettingsTest, AddsPathToAddressOfAllSignalsOnly) {
  const std::string all = "OTEL_EXPORTER_OTLP_ENDPOINT";
  const std::string traces = "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT";
  EXPECT_EQ(Read({{all, "http://c:4318"}}).target.url, "http://c:4318/v1/traces");
  EXPECT_EQ(Read({{all, " http://c:4318/mycollector/ "}}).target.url,
            "http://c:4318/mycollector/v1/traces");
  EXPECT_EQ(Read({{all, "http://c:4318"}, {traces, "https://t/in"}}).target.url, "https://t/in");
  EXPECT_EQ(Read({{traces, "https://t/in"}}, "http://[::1]:4318").target.url,
            "http://[::1]:4318/v1/traces");
}

TEST(TraceSettingsTest, MalformedOptionIsAnErrorAndMalformedVariableAWarning) {
  for (const char* bad : {"localhost:4318",
                          "grpc://c:4317",
                          "http://",
                          "http://:4318",
                          "http://c:4318/?key=1",
                          "http://c d",
                          "http://user:secret@c:4318"}) {
    EXPECT_THROW(Read({}, bad), Error) << bad;
    const TraceSettings settings = Read({{"OTEL_EXPORTER_OTLP_ENDPOINT", bad}});
    EXPECT_EQ(settings.target.url, "") << bad;
    EXPECT_THAT(settings.warnings, ElementsAre(HasSubstr("OTEL_EXPORTER_OTLP_ENDPOINT"))) << bad;
    EXPECT_THAT(settings.warnings, Not(::testing::Contains(HasSubstr("secret"))));
  }
}

TEST(TraceSettingsTest, ReadsHeadersServiceAndLimit) {
  Variables variables = {{"OTEL_EXPORTER_OTLP_ENDPOINT", "http://c:4318"},
                         {"OTEL_EXPORTER_OTLP_HEADERS", "api-key=a%20b%2C, x = 1 ,"},
                         {"OTEL_EXPORTER_OTLP_TIMEOUT", "2500"},
                         {"OTEL_EXPORTER_OTLP_CERTIFICATE", "ca.pem"},
                         {"OTEL_RESOURCE_ATTRIBUTES", "service.name=one,site=lab"}};
  TraceSettings settings = Read(variables);
  EXPECT_THAT(settings.target.headers, ElementsAre(Pair("api-key", "a b,"), Pair("x", "1")));
  EXPECT_EQ(settings.target.limit.count(), 2500);
  EXPECT_EQ(settings.target.certificate, "ca.pem");
  EXPECT_EQ(settings.service, "one");
  EXPECT_THAT(settings.attributes, ElementsAre(Pair("site", AttributeValue("lab"))));
  EXPECT_THAT(settings.warnings, IsEmpty());
  variables["OTEL_SERVICE_NAME"] = "two";
  variables["OTEL_EXPORTER_OTLP_TRACES_HEADERS"] = "key=secret,broken,injected=a%0d%0ab";
  variables["OTEL_EXPORTER_OTLP_TIMEOUT"] = "soon";
  settings = Read(variables);
  EXPECT_EQ(settings.service, "two");
  EXPECT_THAT(settings.target.headers, ElementsAre(Pair("key", "secret")));
  EXPECT_EQ(settings.target.limit.count(), 10'000);
  EXPECT_THAT(settings.warnings,
              ElementsAre(Not(HasSubstr("secret")), HasSubstr("OTEL_EXPORTER_OTLP_TIMEOUT")));
}

TEST(TraceSettingsTest, SamplersDecideAsSpecified) {
  const std::string low = "4bf92f3577b34da6a300000000000001";
  const std::string high = "4bf92f3577b34da6a3ffffffffffffff";
  const std::optional<TraceContext> yes = TraceContext{low, "00f067aa0ba902b7", true};
  const std::optional<TraceContext> no = TraceContext{low, "00f067aa0ba902b7", false};
  const auto sampler = [](const std::string& name, const std::string& argument = "") {
    return Read({{"OTEL_EXPORTER_OTLP_ENDPOINT", "http://c:4318"},
                 {"OTEL_TRACES_SAMPLER", name},
                 {"OTEL_TRACES_SAMPLER_ARG", argument}})
        .sampler;
  };
  for (const char* name : {"", "parentbased_always_on", "unknown"}) {
    EXPECT_TRUE(sampler(name).Samples(high, std::nullopt)) << name;
    EXPECT_TRUE(sampler(name).Samples(high, yes)) << name;
    EXPECT_FALSE(sampler(name).Samples(high, no)) << name;
  }
  EXPECT_TRUE(sampler("always_on").Samples(high, no));
  EXPECT_FALSE(sampler("always_off").Samples(low, yes));
  EXPECT_FALSE(sampler("parentbased_always_off").Samples(low, std::nullopt));
  EXPECT_TRUE(sampler("parentbased_always_off").Samples(low, yes));
  EXPECT_TRUE(sampler("traceidratio", "0.25").Samples(low, no));
  EXPECT_FALSE(sampler("traceidratio", "0.25").Samples(high, yes));
  EXPECT_FALSE(sampler("parentbased_traceidratio", "0.25").Samples(high, std::nullopt));
  EXPECT_TRUE(sampler("parentbased_traceidratio", "0.25").Samples(high, yes));
  int sampled = 0;
  for (int i = 0; i < 2000; ++i) {
    sampled += sampler("traceidratio", "0.25").Samples(NewTraceId(), std::nullopt) ? 1 : 0;
  }
  EXPECT_NEAR(sampled, 500, 120);  // six standard deviations
  EXPECT_TRUE(sampler("traceidratio", "much").Samples(high, std::nullopt));
}

}  // namespace
}  // namespace color3d
