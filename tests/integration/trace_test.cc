// Traces from client to stage: real server, workers and client, and a collector of this test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/integration/service_fixture.h"
#include "tests/support/service/received_spans.h"

namespace color3d {
namespace {

using std::chrono::seconds;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using testing::HttpReceiver;
using ::testing::Not;
using testing::ReceivedSpan;
using testing::SpansNamed;
using testing::SpansOf;

constexpr int64_t kNsPerMs = 1'000'000;
// Times of jobs are in whole milliseconds.
constexpr int64_t kRounding = kNsPerMs;
// The end of an attempt is that of its last call, which the server answers after the job has ended.
constexpr int64_t kAnswer = 2'000 * kNsPerMs;

class TraceTest : public ServiceTest {
 protected:
  ~TraceTest() override { SetCollector(""); }

  // With scripted stages, which take no time.
  void StartScripted(const std::string& endpoint = "") {
    std::vector<std::string> flags = {"--worker-program", COLOR3D_TEST_WORKER};
    if (!endpoint.empty()) flags.insert(flags.end(), {"--otlp-endpoint", endpoint});
    StartServer(flags);
  }
  static void SetCollector(const std::string& endpoint) {
    if (endpoint.empty()) {
      ::unsetenv("OTEL_EXPORTER_OTLP_ENDPOINT");
    } else {
      ::setenv("OTEL_EXPORTER_OTLP_ENDPOINT", endpoint.c_str(), 1);
    }
  }
  ProcessResult Colorize(const std::vector<std::string>& more = {}) {
    const std::string room = Path("room").string();
    if (!std::filesystem::exists(room)) {
      ProceduralSceneOptions options = SmallRoom(4, /*gray=*/true);
      options.width = 160;
      options.height = 120;
      WriteProceduralScene(room, options);
    }
    return Client(std::vector<std::string>{"colorize",
                                           room,
                                           "--auto",
                                           "--key-view",
                                           "view002",
                                           "-o",
                                           Path("out" + std::to_string(++outs_)).string()} +
                  QuickOptions() + more);
  }
  void ExpectOneTree(HttpReceiver& collector);

  int outs_ = 0;
};

// Checks the spans of one `color3d colorize`.
void TraceTest::ExpectOneTree(HttpReceiver& collector) {
  const std::vector<ReceivedSpan> all = SpansOf(collector);
  const std::vector<ReceivedSpan> roots = SpansNamed(all, "color3d colorize");
  ASSERT_EQ(roots.size(), 1u);
  const ReceivedSpan& root = roots[0];
  EXPECT_EQ(root.service, "color3d");
  EXPECT_EQ(root.parent, "");
  EXPECT_EQ(root.error, "");
  std::map<std::string, ReceivedSpan> spans;
  for (const ReceivedSpan& span : all) {
    EXPECT_EQ(span.trace, root.trace) << span.name;
    EXPECT_TRUE(spans.emplace(span.id, span).second) << span.name << " was sent twice";
    EXPECT_THAT(span.name, Not(HasSubstr("internal")));
    EXPECT_THAT(span.name, Not(HasSubstr("grpc.health")));
  }
  std::map<std::string, int> kinds;
  for (const auto& [id, span] : spans) {
    EXPECT_LE(span.start_ns, span.end_ns) << span.name;
    if (id == root.id) continue;
    ASSERT_TRUE(spans.contains(span.parent)) << span.name << " has no parent";
    const ReceivedSpan& parent = spans.at(span.parent);
    const std::string kind = span.name.substr(0, span.name.find(' '));
    const std::string edge = parent.name + " > " + span.name;
    // Jobs of a graph are written in one call, one after the other, the submitted one last.
    const bool is_child = kind == "job" && parent.name.starts_with("job ");
    const ReceivedSpan& begin = is_child ? spans.at(parent.parent) : parent;
    EXPECT_GE(span.start_ns, begin.start_ns - kRounding) << edge;
    if (span.name.starts_with("color3d.v1.") || span.name.starts_with("google.")) {
      EXPECT_EQ(span.service, "color3d-server");
      EXPECT_EQ(parent.id, root.id) << edge;
      EXPECT_LE(span.end_ns, parent.end_ns + kRounding) << edge;
      ++kinds["call"];
      continue;
    }
    ++kinds[kind];
    if (kind == "job") {
      EXPECT_EQ(span.service, "color3d-server");
      if (is_child) {
        EXPECT_EQ(parent.name, "job colorize_scene");
        EXPECT_LE(span.end_ns, parent.end_ns) << edge;
      } else {
        EXPECT_EQ(edge, "color3d.v1.JobService/CreateJob > job colorize_scene");
        EXPECT_LE(span.start_ns, parent.end_ns) << edge;
        EXPECT_LE(span.end_ns, root.end_ns) << edge;
      }
    } else if (span.name == "queue") {
      EXPECT_THAT(parent.name, HasSubstr("job "));
      EXPECT_LE(span.end_ns, parent.end_ns) << edge;
    } else if (kind == "stage") {
      EXPECT_EQ(span.service, "color3d-worker");
      EXPECT_EQ(parent.name, "job " + span.name.substr(6));
      EXPECT_EQ(span.attributes.at("color3d.outcome"), "succeeded");
      EXPECT_EQ(span.attributes.at("color3d.attempt"), "1");
      EXPECT_THAT(span.attributes.at("color3d.worker"), HasSubstr("worker-1"));
      EXPECT_EQ(span.attributes.at("color3d.job"), parent.attributes.at("color3d.job"));
      EXPECT_GT(std::stoll(span.attributes.at("color3d.peak_memory_bytes")), 0);
      EXPECT_LE(span.end_ns, parent.end_ns + kAnswer) << edge;
    } else {
      EXPECT_THAT((std::set<std::string>{"read inputs", "run", "publish"}), Contains(span.name));
      EXPECT_THAT(parent.name, HasSubstr("stage "));
      EXPECT_LE(span.end_ns, parent.end_ns) << edge;
    }
  }
  // Each job that was not left out has one attempt with three parts.
  int ran = 0;
  for (const v1::Job& job : server().ListJobs()) {
    ran += job.state() == v1::Job::STATE_SUCCEEDED ? 1 : 0;
  }
  EXPECT_GE(ran, 5);
  EXPECT_EQ(kinds["stage"], ran);
  EXPECT_EQ(kinds["queue"], ran);
  EXPECT_EQ(kinds["run"], ran);
  EXPECT_EQ(kinds["read"], ran);
  EXPECT_EQ(kinds["publish"], ran);
  EXPECT_EQ(kinds["job"], static_cast<int>(server().ListJobs().size()));
  EXPECT_GE(kinds["call"], 4) << "scene, uploads, job, watch";
}

TEST_F(TraceTest, SpansOfJobFormOneTreeFromClientToStage) {
  HttpReceiver collector({"200 OK"});
  StartScripted(collector.url());
  SetCollector(collector.url());
  const ProcessResult result = Colorize();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  SetCollector("");
  // Spans wait for at most a second for others.
  EXPECT_TRUE(WaitUntil(
      [&] {
        const auto spans = SpansOf(collector);
        return !SpansNamed(spans, "job colorize_scene").empty() &&
               !SpansNamed(spans, "stage colorize_scene").empty();
      },
      seconds(20)));
  ExpectOneTree(collector);
}

TEST_F(TraceTest, RealStagesFormOneTree) {
  HttpReceiver collector({"200 OK"});
  SetCollector(collector.url());
  StartServer();
  const ProcessResult result = Colorize();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(WaitUntil(
      [&] {
        const auto spans = SpansOf(collector);
        return !SpansNamed(spans, "job colorize_scene").empty() &&
               !SpansNamed(spans, "stage colorize_scene").empty();
      },
      seconds(20)));
  ExpectOneTree(collector);
}

TEST_F(TraceTest, ServerSendsLastSpansAtItsEnd) {
  HttpReceiver collector({"200 OK"});
  StartScripted(collector.url());
  ASSERT_EQ(Colorize().exit_code, 0);
  EXPECT_EQ(server().Stop(), 0);
  const std::vector<ReceivedSpan> spans = SpansOf(collector);
  EXPECT_EQ(SpansNamed(spans, "job colorize_scene").size(), 1u);
  EXPECT_EQ(SpansNamed(spans, "stage colorize_scene").size(), 1u);
}

TEST_F(TraceTest, CommandIsPartOfTheTraceOfItsCaller) {
  HttpReceiver collector({"200 OK"});
  StartScripted(collector.url());
  SetCollector(collector.url());
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  ::setenv("TRACEPARENT", ("00-" + trace + "-00f067aa0ba902b7-00").c_str(), 1);
  EXPECT_EQ(Client({"server", "info"}).exit_code, 0);
  ::setenv("TRACEPARENT", ("00-" + trace + "-00f067aa0ba902b7-01").c_str(), 1);
  EXPECT_EQ(Client({"server", "info"}).exit_code, 0);
  EXPECT_EQ(Client({"job", "show", "jobs/none"}).exit_code, 2);
  ::unsetenv("TRACEPARENT");
  EXPECT_EQ(server().Stop(), 0);
  const std::vector<ReceivedSpan> spans = SpansOf(collector);
  const auto infos = SpansNamed(spans, "color3d server info");
  ASSERT_EQ(infos.size(), 1u) << "the first is not sampled";
  EXPECT_EQ(infos[0].trace, trace);
  EXPECT_EQ(infos[0].parent, "00f067aa0ba902b7");
  const auto calls = SpansNamed(spans, "color3d.v1.ServerService/GetServerInfo");
  ASSERT_EQ(calls.size(), 1u);
  EXPECT_EQ(calls[0].parent, infos[0].id);
  const auto failed = SpansNamed(spans, "color3d job show");
  ASSERT_EQ(failed.size(), 1u);
  EXPECT_EQ(failed[0].error, "exit code 2");
}

// Without a collector, with one that does not answer, and with one that fails.
TEST_F(TraceTest, BadCollectorNeitherSlowsNorFailsJobs) {
  HttpReceiver hanging({"hang"}), failing({"500 Oops"});
  std::string nobody;
  {
    const HttpReceiver gone({"200 OK"});
    nobody = gone.url();
  }
  double usual = 0.0;
  for (const std::string& collector : {std::string(), hanging.url(), failing.url(), nobody}) {
    SetCollector(collector);
    StartScripted();
    const ProcessResult result = Colorize({"--seed", std::to_string(outs_ + 1)});
    EXPECT_EQ(result.exit_code, 0) << collector << result.err;
    if (collector.empty()) {
      usual = result.seconds;
      continue;
    }
    // The command waits at most a second for its collector.
    EXPECT_LT(result.seconds, 2.0 * usual + 3.0) << collector;
    EXPECT_THAT(result.err, HasSubstr("trace"));
    EXPECT_TRUE(server().IsHealthy());
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(server().Stop(), 0) << collector;
    EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(10)) << collector;
    EXPECT_THAT(server().Log(),
                AnyOf(HasSubstr("traces cannot be sent"), HasSubstr("traces were not sent")));
  }
  EXPECT_FALSE(hanging.requests().empty());
  EXPECT_FALSE(failing.requests().empty());
}

TEST_F(TraceTest, SecretsOfCollectorDoNotReachWorkers) {
  HttpReceiver collector({"200 OK"});
  SetCollector(collector.url());
  ::setenv("OTEL_EXPORTER_OTLP_HEADERS", "api-key=secret-of-collector", 1);
  StartScripted();
  ::unsetenv("OTEL_EXPORTER_OTLP_HEADERS");
  ASSERT_EQ(Colorize().exit_code, 0);
  EXPECT_EQ(server().Stop(), 0);
  std::map<std::string, std::string> keys;  // by service
  for (const HttpReceiver::Request& request : collector.requests()) {
    for (const char* service : {"color3d-server", "color3d-worker"}) {
      if (request.body.find(service) == std::string::npos) continue;
      const auto key = request.headers.find("api-key");
      keys[service] = key == request.headers.end() ? "" : key->second;
    }
  }
  EXPECT_EQ(keys.at("color3d-server"), "secret-of-collector");
  EXPECT_EQ(keys.at("color3d-worker"), "");
  EXPECT_THAT(server().Log(), HasSubstr("OTEL_EXPORTER_OTLP_HEADERS"));
  EXPECT_THAT(server().Log(), Not(HasSubstr("secret-of-collector")));
}

TEST_F(TraceTest, MalformedEndpointIsRefused) {
  try {
    StartScripted("collector:4317");
    FAIL() << "the server started";
  } catch (const std::exception& e) {
    EXPECT_THAT(e.what(), HasSubstr("--otlp-endpoint is 'collector:4317'"));
  }
}

}  // namespace
}  // namespace color3d
