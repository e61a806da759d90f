#include "server/base/service_error.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(ServiceErrorTest, FormatsMessageOrTakesViolations) {
  const std::string name = "scenes/a";
  const ServiceError formatted(ErrorReason::kSceneNotFound, "there is no '{}' ({} left)", name, 2);
  EXPECT_STREQ(formatted.what(), "there is no 'scenes/a' (2 left)");
  EXPECT_EQ(formatted.reason(), ErrorReason::kSceneNotFound);
  EXPECT_TRUE(formatted.violations().empty());

  const ServiceError plain(ErrorReason::kLeaseLost, "{} stays");
  EXPECT_STREQ(plain.what(), "{} stays");

  const std::vector<FieldViolation> violations = {{"spec.seed", "is odd"}};
  const ServiceError listed(ErrorReason::kBadOption, "two things", violations);
  ASSERT_EQ(listed.violations().size(), 1u);
  EXPECT_EQ(listed.violations()[0].field, "spec.seed");
  const ServiceError written(ErrorReason::kBadOption, name, {{"a", "b"}, {"c", "d"}});
  EXPECT_EQ(written.violations().size(), 2u);
}

TEST(ServiceErrorTest, TakesCodeOfReasonUnlessGiven) {
  EXPECT_EQ(ServiceError(ErrorReason::kTokenMissing, "").code(), ErrorCode::kUnauthenticated);
  EXPECT_EQ(ServiceError(ErrorReason::kRoleTooLow, "{}", 1).code(), ErrorCode::kPermissionDenied);
  EXPECT_EQ(ServiceError(ErrorReason::kRevisionCompacted, "").code(), ErrorCode::kOutOfRange);
  EXPECT_EQ(ServiceError(ErrorCode::kUnavailable, ErrorReason::kBlobMissing, "").code(),
            ErrorCode::kUnavailable);
  EXPECT_EQ(ServiceError(ErrorCode::kUnavailable, ErrorReason::kBlobMissing, "{}", 1).code(),
            ErrorCode::kUnavailable);
}

TEST(ServiceErrorTest, ReasonOfAnyErrorHasName) {
  EXPECT_EQ(ReasonOf(ServiceError(ErrorReason::kBlobMissing, "gone")), "BLOB_MISSING");
  EXPECT_EQ(ReasonOf(InvalidArgument("wrong")), "INVALID_ARGUMENT");
}

TEST(ServiceErrorTest, HasReasonTellsServiceErrorsApart) {
  EXPECT_TRUE(HasReason(ServiceError(ErrorReason::kLeaseLost, "lost"), ErrorReason::kLeaseLost));
  EXPECT_FALSE(HasReason(ServiceError(ErrorReason::kDraining, "ends"), ErrorReason::kLeaseLost));
  EXPECT_FALSE(HasReason(Error(ErrorCode::kAborted, "lost"), ErrorReason::kLeaseLost));
}

}  // namespace
}  // namespace color3d
