// The measurement of a small store: that it measures every call, not how fast it is.
#include "tests/bench/scale/store_times.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/support/service/postgresql_cluster.h"

namespace color3d {
namespace {

StoreLoad SmallLoad(const std::string& database) {
  StoreLoad load;
  load.database = database;
  load.finished = 100;
  load.queued = 100;
  load.claims = 20;
  load.callers = 3;
  return load;
}

void ExpectAllMeasured(const StoreTimes& times) {
  int64_t claims = 0;
  for (const CallTimes& call : times.calls) {
    EXPECT_GT(call.p50, 0.0) << call.call;
    EXPECT_GT(call.cpu_p50, 0.0) << call.call;
    EXPECT_LE(call.p50, call.p99) << call.call;
    EXPECT_LE(call.p99, call.most) << call.call;
    if (call.call.starts_with("Claim")) claims += call.calls;
  }
  EXPECT_EQ(claims, 20 + 20 + 50);
  const ServiceTimes& service = times.service;
  for (const double seconds : {service.claim_write,
                               service.prepare_read,
                               service.join_write,
                               service.publish_write,
                               service.heartbeat_write,
                               service.worker_write,
                               service.checkpoint_write}) {
    EXPECT_GT(seconds, 0.0);
  }
}

TEST(StoreTimesTest, MeasuresSqlite) { ExpectAllMeasured(MeasureStore(SmallLoad("sqlite"))); }

TEST(StoreTimesTest, MeasuresPostgresql) {
  if (!testing::PostgresqlCluster::IsInstalled()) GTEST_SKIP() << "NOT TESTED: no PostgreSQL";
  ExpectAllMeasured(MeasureStore(SmallLoad("postgresql")));
}

TEST(StoreTimesTest, RefusesImpossibleLoads) {
  EXPECT_THROW(MeasureStore(SmallLoad("mysql")), Error);
  StoreLoad load = SmallLoad("sqlite");
  load.queued = 10;
  EXPECT_THROW(MeasureStore(load), Error) << "more claims than queued jobs";
}

}  // namespace
}  // namespace color3d
