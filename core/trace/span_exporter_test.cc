#include "core/trace/span_exporter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/trace/tracer.h"
#include "tests/support/service/http_receiver.h"

namespace color3d {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::HttpReceiver;

class SpanExporterTest : public ::testing::Test {
 protected:
  ExporterOptions Options(const HttpReceiver& collector) {
    ExporterOptions options;
    options.target.url = collector.url("/v1/traces");
    options.resource = {"color3d", "1", {{"service.name", "test"}}};
    options.pause = milliseconds(10);
    options.first_retry = milliseconds(10);
    options.on_problem = [this](const std::string& line) {
      const MutexLock lock(mutex_);
      lines_.push_back(line);
    };
    return options;
  }
  static Span Named(const std::string& name) {
    Span span;
    span.context = {NewTraceId(), NewSpanId(), true};
    span.name = name;
    return span;
  }
  static std::vector<std::string> NamesIn(const HttpReceiver::Request& request) {
    const auto json = nlohmann::json::parse(request.body);
    std::vector<std::string> names;
    for (const auto& span : json.at("resourceSpans")[0].at("scopeSpans")[0].at("spans")) {
      names.push_back(span.at("name"));
    }
    return names;
  }
  std::vector<std::string> lines() {
    const MutexLock lock(mutex_);
    return lines_;
  }

 private:
  Mutex mutex_;
  std::vector<std::string> lines_ COLOR3D_GUARDED_BY(mutex_);
};

TEST_F(SpanExporterTest, SendsBatchesWithHeaders) {
  HttpReceiver collector({"200 OK"});
  ExporterOptions options = Options(collector);
  options.target.headers = {{"api-key", "secret"}};
  options.max_batch = 2;
  options.pause = std::chrono::seconds(60);
  SpanExporter exporter(options);
  for (const char* name : {"a", "b", "c"}) exporter.Add(Named(name));
  ASSERT_TRUE(collector.WaitFor(1)) << "a full batch does not wait";
  EXPECT_TRUE(exporter.Flush(std::chrono::seconds(10)));
  const auto requests = collector.requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].line, "POST /v1/traces HTTP/1.1");
  EXPECT_EQ(requests[0].headers.at("content-type"), "application/json");
  EXPECT_EQ(requests[0].headers.at("api-key"), "secret");
  EXPECT_THAT(NamesIn(requests[0]), ElementsAre("a", "b"));
  EXPECT_THAT(NamesIn(requests[1]), ElementsAre("c"));
  EXPECT_EQ(exporter.counts().sent, 3);
  EXPECT_EQ(exporter.counts().dropped, 0);
}

TEST_F(SpanExporterTest, RepeatsWhatTheCollectorCannotTakeNow) {
  HttpReceiver collector({"503 Busy", "429 Slow Down\r\nRetry-After: 1", "200 OK"});
  SpanExporter exporter(Options(collector));
  exporter.Add(Named("a"));
  ASSERT_TRUE(collector.WaitFor(3));
  const auto requests = collector.requests();
  EXPECT_GE(requests[2].time - requests[1].time, milliseconds(950)) << "Retry-After is in seconds";
  EXPECT_LT(requests[1].time - requests[0].time, milliseconds(900));
  for (const auto& request : requests) EXPECT_EQ(request.body, requests[0].body);
  EXPECT_TRUE(exporter.Flush(std::chrono::seconds(10)));
  EXPECT_EQ(exporter.counts().sent, 1);
  EXPECT_THAT(lines(), ElementsAre(HasSubstr("HTTP status 503"), HasSubstr("0 spans")));
}

TEST_F(SpanExporterTest, DropsWhatTheCollectorRefusesAndSaysSoOnce) {
  HttpReceiver collector({"400 Bad Request"});
  ExporterOptions options = Options(collector);
  options.max_batch = 1;
  SpanExporter exporter(options);
  for (int i = 0; i < 5; ++i) exporter.Add(Named("a"));
  ASSERT_TRUE(collector.WaitFor(5));
  EXPECT_TRUE(exporter.Flush(std::chrono::seconds(10)));
  EXPECT_EQ(collector.requests().size(), 5u) << "not repeated";
  EXPECT_EQ(exporter.counts().dropped, 5);
  EXPECT_THAT(lines(), ElementsAre(HasSubstr("HTTP status 400")));
}

TEST_F(SpanExporterTest, GivesUpAfterMaxTries) {
  HttpReceiver collector({"503 Busy", "503 Busy", "503 Busy", "200 OK"});
  ExporterOptions options = Options(collector);
  options.max_tries = 3;
  SpanExporter exporter(options);
  exporter.Add(Named("lost"));
  ASSERT_TRUE(collector.WaitFor(3));
  exporter.Add(Named("next"));
  ASSERT_TRUE(collector.WaitFor(4));
  EXPECT_THAT(NamesIn(collector.requests()[3]), ElementsAre("next"));
  EXPECT_TRUE(exporter.Flush(std::chrono::seconds(10)));
  EXPECT_EQ(exporter.counts().dropped, 1);
  EXPECT_EQ(exporter.counts().sent, 1);
}

TEST_F(SpanExporterTest, HangingCollectorBlocksNobodyAndMemoryIsBounded) {
  HttpReceiver collector({"hang"});
  ExporterOptions options = Options(collector);
  options.max_queue = 100;
  options.max_batch = 10;
  steady_clock::time_point begin;
  {
    SpanExporter exporter(options);
    exporter.Add(Named("first"));
    ASSERT_TRUE(collector.WaitFor(1));
    begin = steady_clock::now();
    for (int i = 0; i < 1000; ++i) exporter.Add(Named(std::to_string(i)));
    EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(2));
    EXPECT_EQ(exporter.counts().dropped, 900);
    begin = steady_clock::now();
    EXPECT_FALSE(exporter.Flush(milliseconds(200)));
    EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(5));
    begin = steady_clock::now();
  }
  EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(5)) << "the request is aborted";
}

TEST_F(SpanExporterTest, DropsTheOldestFirst) {
  HttpReceiver collector({"503 Busy\r\nRetry-After: 1", "200 OK"});
  ExporterOptions options = Options(collector);
  options.max_queue = 2;
  options.pause = milliseconds(0);
  SpanExporter exporter(options);
  exporter.Add(Named("first"));
  ASSERT_TRUE(collector.WaitFor(1));
  for (const char* name : {"a", "b", "c"}) exporter.Add(Named(name));
  ASSERT_TRUE(collector.WaitFor(3));
  EXPECT_THAT(NamesIn(collector.requests()[2]), ElementsAre("b", "c"));
}

TEST_F(SpanExporterTest, AbsentCollectorDelaysNoEnd) {
  ExporterOptions options;
  {
    const HttpReceiver gone({"200 OK"});
    options = Options(gone);
  }
  options.first_retry = std::chrono::seconds(60);
  SpanExporter exporter(options);
  exporter.Add(Named("a"));
  const auto begin = steady_clock::now();
  EXPECT_TRUE(exporter.Flush(std::chrono::seconds(30))) << "given up, not repeated";
  EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(15));
  EXPECT_EQ(exporter.counts().dropped, 1);
}

TEST_F(SpanExporterTest, TracerRecordsSampledSpansOnly) {
  HttpReceiver collector({"200 OK"});
  TraceSettings settings;
  EXPECT_EQ(Tracer::Make(settings, "1", nullptr), nullptr);
  settings.target.url = collector.url();
  settings.service = "test";
  settings.attributes = {{"site", "lab"}};
  const auto tracer = Tracer::Make(settings, "1", [](const std::string&) {});
  for (const bool sampled : {true, false}) {
    const TraceContext parent{NewTraceId(), NewSpanId(), sampled};
    Span span = Named(sampled ? "yes" : "no");
    span.context = tracer->Begin(parent);
    EXPECT_EQ(span.context.trace_id, parent.trace_id);
    EXPECT_NE(span.context.span_id, parent.span_id);
    tracer->Record(span);
  }
  EXPECT_TRUE(tracer->Flush(std::chrono::seconds(10)));
  ASSERT_EQ(collector.requests().size(), 1u);
  EXPECT_THAT(NamesIn(collector.requests()[0]), ElementsAre("yes"));
  EXPECT_THAT(collector.requests()[0].body, HasSubstr("\"site\""));
}

}  // namespace
}  // namespace color3d
