#include "client/lib/job_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/service/breaking_server.h"

namespace color3d::client {
namespace {

using ::testing::ElementsAre;
using JobWatchTest = BreakingServerTest;

TEST_F(JobWatchTest, ResumesAtLastRevision) {
  const grpc::Status broken(grpc::StatusCode::UNAVAILABLE, "broken");
  jobs_.script = {{{3, 5}, broken, 2200}, {{8}, broken}, {{9}, grpc::Status::OK}};
  std::vector<int64_t> seen;
  const WatchEnd end = WatchJobs(
      *connection_,
      {"jobs/1"},
      [&](const v1::JobEvent& event) { seen.push_back(event.revision()); },
      [] { return true; });
  EXPECT_EQ(end, WatchEnd::kFinished);
  EXPECT_THAT(seen, ElementsAre(3, 5, 8, 9));
  EXPECT_THAT(jobs_.asked, ElementsAre(0, 5, 8));
}

TEST_F(JobWatchTest, RereadsStateIfFirstStreamBreaks) {
  const grpc::Status broken(grpc::StatusCode::UNAVAILABLE, "broken");
  jobs_.script = {{{7}, broken}, {{7}, grpc::Status::OK}};
  WatchJobs(
      *connection_, {"jobs/1"}, [](const v1::JobEvent&) {}, [] { return true; });
  EXPECT_THAT(jobs_.asked, ElementsAre(0, 0));
}

TEST_F(JobWatchTest, ResumesAfterServerCancelsCall) {
  jobs_.script = {{{7}, grpc::Status(grpc::StatusCode::CANCELLED, "")}, {{7}, grpc::Status::OK}};
  WatchJobs(
      *connection_, {"jobs/1"}, [](const v1::JobEvent&) {}, [] { return true; });
  EXPECT_THAT(jobs_.asked, ElementsAre(0, 0));
}

TEST_F(JobWatchTest, WaitsWhileServerIsBusyUnlessStopped) {
  jobs_.script = {{{}, TurnedAway()}, {{7}, grpc::Status::OK}, {{}, TurnedAway()}};
  const auto watch = [&](const std::function<bool()>& keep_going) {
    return WatchJobs(
        *connection_, {"jobs/1"}, [](const v1::JobEvent&) {}, keep_going);
  };
  EXPECT_EQ(watch([] { return true; }), WatchEnd::kFinished);
  EXPECT_EQ(watch([&] { return jobs_.asked.size() < 3; }), WatchEnd::kStopped);
}

TEST_F(JobWatchTest, RestartsIfRevisionIsGone) {
  const grpc::Status broken(grpc::StatusCode::UNAVAILABLE, "broken");
  const grpc::Status gone(grpc::StatusCode::OUT_OF_RANGE, "compacted");
  jobs_.script = {{{4}, broken, 2200}, {{}, gone}, {{6}, grpc::Status::OK}};
  WatchJobs(
      *connection_, {"jobs/1"}, [](const v1::JobEvent&) {}, [] { return true; });
  EXPECT_THAT(jobs_.asked, ElementsAre(0, 4, 0));
}

TEST_F(JobWatchTest, StopsOnRequestAndThrowsServerErrors) {
  jobs_.script = {{{1}, grpc::Status::OK, 5000},
                  {{}, grpc::Status(grpc::StatusCode::NOT_FOUND, "no such job")}};
  int events = 0;
  const auto count = [&](const v1::JobEvent&) { ++events; };
  EXPECT_EQ(WatchJobs(*connection_, {"jobs/1"}, count, [&] { return events == 0; }),
            WatchEnd::kStopped);
  EXPECT_THROW(WatchJobs(*connection_, {"jobs/1"}, count, [] { return true; }), RpcError);
}

}  // namespace
}  // namespace color3d::client
