#include "server/service_error.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(ServiceError, PutsItsMessageTogetherOrTakesItWithViolations) {
  const std::string name = "scenes/a";
  const ServiceError formatted(ErrorCode::kNotFound, "GONE", "there is no '{}' ({} left)", name, 2);
  EXPECT_STREQ(formatted.what(), "there is no 'scenes/a' (2 left)");
  EXPECT_EQ(formatted.reason(), "GONE");
  EXPECT_TRUE(formatted.violations().empty());

  const ServiceError plain(ErrorCode::kAborted, "AS_IT_IS", "{} stays");
  EXPECT_STREQ(plain.what(), "{} stays");

  const std::vector<FieldViolation> violations = {{"spec.seed", "is odd"}};
  const ServiceError listed(ErrorCode::kInvalidArgument, "BAD", "two things", violations);
  ASSERT_EQ(listed.violations().size(), 1u);
  EXPECT_EQ(listed.violations()[0].field, "spec.seed");
  const ServiceError written(ErrorCode::kInvalidArgument, "BAD", name, {{"a", "b"}, {"c", "d"}});
  EXPECT_EQ(written.violations().size(), 2u);
}

TEST(ServiceError, TheReasonOfAnyErrorIsKnown) {
  EXPECT_EQ(ReasonOf(ServiceError(ErrorCode::kNotFound, "GONE", "gone")), "GONE");
  EXPECT_EQ(ReasonOf(InvalidArgument("wrong")), "INVALID_ARGUMENT");
}

}  // namespace
}  // namespace color3d
