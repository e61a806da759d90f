#include "core/base/text/lower_case.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(LowerCase, ChangesAsciiLettersOnly) {
  EXPECT_EQ(LowerCase("DSC_0423.JPG"), "dsc_0423.jpg");
  EXPECT_EQ(LowerCase("\xc3\x84pfel.TIFF"), "\xc3\x84pfel.tiff");
  EXPECT_EQ(LowerCase(""), "");
}

}  // namespace
}  // namespace color3d
