#include "core/catalogue/error_reasons.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace color3d {
namespace {

TEST(ErrorReasonsTest, NamesAreUniqueAndUpperSnakeCase) {
  std::set<std::string> names;
  for (int i = 0; i <= static_cast<int>(ErrorReason::kWrongState); ++i) {
    const std::string name = ErrorReasonName(static_cast<ErrorReason>(i));
    EXPECT_EQ(name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_"), std::string::npos) << name;
    EXPECT_TRUE(names.insert(name).second) << name;
  }
}

}  // namespace
}  // namespace color3d
