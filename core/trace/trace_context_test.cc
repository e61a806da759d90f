#include "core/trace/trace_context.h"

#include <gtest/gtest.h>

#include <set>

namespace color3d {
namespace {

const std::string kTrace = "4bf92f3577b34da6a3ce929d0e0e4736";
const std::string kSpan = "00f067aa0ba902b7";

TEST(TraceContextTest, ReadsWhatItWrites) {
  for (const bool sampled : {false, true}) {
    const auto read = ParseTraceparent(ToTraceparent({kTrace, kSpan, sampled}));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->trace_id, kTrace);
    EXPECT_EQ(read->span_id, kSpan);
    EXPECT_EQ(read->sampled, sampled);
  }
}

TEST(TraceContextTest, ReadsLaterVersionsAndOtherFlags) {
  const auto later = ParseTraceparent("cc-" + kTrace + "-" + kSpan + "-03-later-fields");
  ASSERT_TRUE(later);
  EXPECT_TRUE(later->sampled);
  EXPECT_FALSE(ParseTraceparent("00-" + kTrace + "-" + kSpan + "-02")->sampled);
}

TEST(TraceContextTest, RejectsMalformedTraceparents) {
  const std::string rest = "-" + kSpan + "-01";
  for (const std::string& bad : {std::string(),
                                 "00-" + kTrace + rest + "-more",
                                 "ff-" + kTrace + rest,
                                 "00-" + std::string(32, '0') + rest,
                                 "00-" + kTrace + "-0000000000000000-01",
                                 "00-4BF92F3577B34DA6A3CE929D0E0E4736" + rest,
                                 "00_" + kTrace + rest,
                                 "00-" + kTrace,
                                 "00-" + kTrace + "-" + kSpan + "-0x",
                                 "0x-" + kTrace + rest}) {
    EXPECT_FALSE(ParseTraceparent(bad)) << bad;
    EXPECT_EQ(TraceIdOf(bad), "") << bad;
  }
}

TEST(TraceContextTest, FindsTraceIdsOfOldJobs) {
  EXPECT_EQ(TraceIdOf(kTrace), kTrace);
  EXPECT_EQ(TraceIdOf("00-" + kTrace + "-" + kSpan + "-01"), kTrace);
}

TEST(TraceContextTest, IdsAreRandomOrDerived) {
  std::set<std::string> ids;
  for (int i = 0; i < 100; ++i) ids.insert({NewTraceId(), NewSpanId()});
  EXPECT_EQ(ids.size(), 200u);
  EXPECT_TRUE(ParseTraceparent(ToTraceparent({NewTraceId(), NewSpanId(), true})));
  const std::string derived = DerivedSpanId(kTrace, "jobs/a");
  EXPECT_EQ(derived, "d79b66d2e51f019f") << "processes of all versions must agree";
  EXPECT_NE(derived, DerivedSpanId(kTrace, "jobs/b"));
  EXPECT_NE(derived, DerivedSpanId(NewTraceId(), "jobs/a"));
}

}  // namespace
}  // namespace color3d
