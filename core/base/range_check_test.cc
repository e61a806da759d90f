#include "core/base/range_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

// Returns the message of a check; empty if it accepts the value.
std::string RangeComplaint(double value, double low, double high) {
  try {
    RangeCheck("test option")("sigma", value, low, high);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
  return "";
}

TEST(RangeCheckTest, NamesFieldValueAndRange) {
  EXPECT_EQ(RangeComplaint(0.25, 0.0, 1.0), "");
  EXPECT_EQ(RangeComplaint(0.0, 0.0, 1.0), "");
  EXPECT_EQ(RangeComplaint(1.0, 0.0, 1.0), "");
  EXPECT_EQ(RangeComplaint(1.00001, 0.0, 1.0), "test option sigma is 1.00001; it must be 0 to 1");
  EXPECT_EQ(RangeComplaint(0.0, 1e-6, 0.5), "test option sigma is 0; it must be 1e-06 to 0.5");
  EXPECT_EQ(RangeComplaint(100001, 0, 100000),
            "test option sigma is 100001; it must be 0 to 100000");
}

TEST(RangeCheckTest, RejectsNaN) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_NE(RangeComplaint(std::nan(""), -infinity, infinity), "");
  EXPECT_NE(RangeComplaint(infinity, 0.0, 1.0), "");
}

}  // namespace
}  // namespace color3d
