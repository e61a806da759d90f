#include "core/base/text/name_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace color3d {
namespace {

TEST(NameOrder, SortsNumbersByValue) {
  std::vector<std::string> names{"f10.png", "f1.png", "f2.png", "f002.png", "e9.png", "f.png"};
  std::sort(names.begin(), names.end(), ComesBefore);
  EXPECT_EQ(
      names,
      (std::vector<std::string>{"e9.png", "f.png", "f1.png", "f002.png", "f2.png", "f10.png"}));
}

TEST(NameOrder, HandlesHugeNumbersAndEqualNames) {
  EXPECT_TRUE(ComesBefore("99999999999999999999998", "99999999999999999999999"));
  EXPECT_TRUE(ComesBefore("9", "10000000000000000000000"));
  EXPECT_FALSE(ComesBefore("a1", "a1"));
  EXPECT_TRUE(ComesBefore("", "0"));
  EXPECT_NE(ComesBefore("a01", "a1"), ComesBefore("a1", "a01"));
}

}  // namespace
}  // namespace color3d
