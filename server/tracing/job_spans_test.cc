#include "server/tracing/job_spans.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/service/job_store_fixture.h"
#include "tests/support/service/received_spans.h"

namespace color3d {
namespace {

using testing::HttpReceiver;
using testing::ReceivedSpan;
using testing::SpansNamed;

constexpr int64_t kNsInMs = 1'000'000;

class JobSpansTest : public JobStoreTest {
 protected:
  JobSpansTest() {
    TraceSettings settings;
    settings.target.url = collector_.url();
    settings.service = "color3d-server";
    tracer_ = Tracer::Make(settings, "1", [](const std::string&) {});
    Start();
  }
  void Start(bool records = true) {
    JobSpansOptions options;
    options.records = [records] { return records; };
    spans_ = std::make_unique<JobSpans>(*store_, tracer_, options);
  }
  // Reads the events up to now and returns all spans.
  std::vector<ReceivedSpan> Finish() {
    spans_.reset();
    EXPECT_TRUE(tracer_->Flush(std::chrono::seconds(10)));
    return SpansOf(collector_);
  }
  // first -> root, made by the call.
  JobRecord Create(bool sampled = true) {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.trace = ToTraceparent({call_.trace_id, call_.span_id, sampled});
    graph.jobs = {Job("first"), Job("root", {0})};
    return store_->CreateGraph(graph, {}, kNoLimit);
  }

  const TraceContext call_{"4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7", true};
  HttpReceiver collector_{{"200 OK"}};
  std::shared_ptr<Tracer> tracer_;
  std::unique_ptr<JobSpans> spans_;
};

TEST_F(JobSpansTest, RecordsJobsBelowTheirCallAndWaitsBelowThem) {
  const JobRecord root = Create();
  wall_ += 100;
  const JobRecord first = ClaimOne();
  wall_ += 1000;
  Succeed(first);
  wall_ += 20;
  const JobRecord last = ClaimOne();
  wall_ += 3;
  Succeed(last);
  const std::vector<ReceivedSpan> spans = Finish();
  ASSERT_EQ(spans.size(), 4u);
  const std::string root_id = DerivedSpanId(call_.trace_id, root.name);
  const ReceivedSpan root_span = SpansNamed(spans, "job root").at(0);
  EXPECT_EQ(root_span.id, root_id);
  EXPECT_EQ(root_span.parent, call_.span_id);
  EXPECT_EQ(root_span.start_ns, 1'000'000 * kNsInMs);
  EXPECT_EQ(root_span.end_ns, 1'001'123 * kNsInMs);
  EXPECT_EQ(root_span.attributes.at("color3d.state"), "SUCCEEDED");
  EXPECT_EQ(root_span.attributes.at("color3d.scene"), "scenes/test");
  const ReceivedSpan first_span = SpansNamed(spans, "job first").at(0);
  EXPECT_EQ(first_span.parent, root_id);
  EXPECT_EQ(first_span.end_ns, 1'001'100 * kNsInMs);
  EXPECT_EQ(first_span.attributes.at("color3d.queue_seconds"), "0.1");
  const std::vector<ReceivedSpan> waits = SpansNamed(spans, "queue");
  ASSERT_EQ(waits.size(), 2u);
  EXPECT_EQ(waits[0].parent, first_span.id);
  EXPECT_EQ(waits[0].end_ns - waits[0].start_ns, 100 * kNsInMs);
  EXPECT_EQ(waits[1].parent, root_id);
  EXPECT_EQ(waits[1].start_ns, 1'001'100 * kNsInMs);
  EXPECT_EQ(waits[1].end_ns, 1'001'120 * kNsInMs);
  for (const ReceivedSpan& span : spans) EXPECT_EQ(span.trace, call_.trace_id);
}

TEST_F(JobSpansTest, RecordsEachWaitAndFailures) {
  Create();
  FailWith(ClaimOne(), ErrorCode::kUnavailable);  // retried
  now_ += 1000;
  wall_ += 1000;
  FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
  const std::vector<ReceivedSpan> spans = Finish();
  const std::vector<ReceivedSpan> waits = SpansNamed(spans, "queue");
  ASSERT_EQ(waits.size(), 2u);
  EXPECT_EQ(waits[1].attributes.at("color3d.attempt"), "2");
  EXPECT_EQ(waits[1].end_ns - waits[1].start_ns, 1000 * kNsInMs);
  const ReceivedSpan first = SpansNamed(spans, "job first").at(0);
  EXPECT_EQ(first.error, "it broke");
  EXPECT_EQ(first.attributes.at("error.type"), "TEST");
  EXPECT_EQ(first.attributes.at("color3d.attempts"), "2");
  EXPECT_THAT(SpansNamed(spans, "job root").at(0).error, ::testing::HasSubstr("it broke"))
      << "ended without a worker";
}

TEST_F(JobSpansTest, RecordsNothingThatIsNotSampledOrNotItsTurn) {
  CreateSingle();  // without a trace
  Succeed(ClaimOne());
  Create(/*sampled=*/false);
  Succeed(ClaimOne());
  Succeed(ClaimOne());
  EXPECT_TRUE(Finish().empty());
  Start(/*records=*/false);
  Create();
  Succeed(ClaimOne());
  EXPECT_TRUE(Finish().empty());
}

TEST_F(JobSpansTest, DeletedJobsAreSkipped) {
  spans_.reset();
  JobSpansOptions slow;
  slow.poll = std::chrono::hours(1);
  spans_ = std::make_unique<JobSpans>(*store_, tracer_, slow);
  const JobRecord root = Create();
  Succeed(ClaimOne());
  Succeed(ClaimOne());
  store_->Delete(root.name, {});
  Create();
  EXPECT_TRUE(Finish().empty());
}

}  // namespace
}  // namespace color3d
