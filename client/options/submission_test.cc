#include "client/options/submission.h"

#include <google/protobuf/util/time_util.h>
#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d::client {
namespace {

TEST(SubmissionTest, DeadlineIsTimeOrTimeFromNow) {
  EXPECT_EQ(ParseDeadline("2026-01-31T18:00:00Z").seconds(), 1'769'882'400);
  const int64_t now = google::protobuf::util::TimeUtil::GetCurrentTime().seconds();
  for (const auto& [text, seconds] : {std::pair{"90m", 5400}, {"12h", 43'200}, {"2d", 172'800}}) {
    EXPECT_NEAR(static_cast<double>(ParseDeadline(text).seconds() - now), seconds, 5.0) << text;
  }
  for (const char* wrong :
       {"", "h", "0h", "-1h", "1.5h", "1w", "999999999d", "tomorrow", "1960-01-01T00:00:00Z"}) {
    EXPECT_THROW(ParseDeadline(wrong), Error) << wrong;
  }
}

}  // namespace
}  // namespace color3d::client
