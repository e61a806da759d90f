#include "core/splat/geometry/geometry_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/base/error.h"

namespace color3d {
namespace {

TEST(TrainGeometryTest, NamesOptionOutOfRange) {
  GeometryOptions options;
  options.ssim_weight = std::numeric_limits<double>::quiet_NaN();
  try {
    options.Validate();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), testing::HasSubstr("ssim_weight"));
  }
}

TEST(TimeLimitTest, RejectsOutOfRangeLimit) {
  for (const double bad : {-1.0, 86'401.0, std::numeric_limits<double>::quiet_NaN()}) {
    GeometryOptions options;
    options.time_limit_seconds = bad;
    EXPECT_THROW(options.Validate(), Error);
  }
}

}  // namespace
}  // namespace color3d
