#include "core/report/contact_sheet.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

SheetView View(const std::string& name, int width, int height, bool chosen = false) {
  return {Image(width, height, 1, 0.5f), name, "score 0.5", chosen};
}

int CountOrange(const Image& sheet) {
  int count = 0;
  for (size_t i = 0; i < sheet.PlaneSize(); ++i) {
    if (sheet.Plane(0)[i] > 0.9f && sheet.Plane(2)[i] < 0.1f) ++count;
  }
  return count;
}

TEST(ContactSheetTest, DrawsAnyNumberOfViewsOfAnyShape) {
  for (int count : {1, 2, 7, 40}) {
    ContactSheet sheet{"Key view", "why", {}, count > 7 ? 1960 : 0, {}, 0};
    for (int i = 0; i < count; ++i) {
      sheet.ranked.push_back(View("v" + std::to_string(i), i % 2 ? 200 : 90, 150, i == 0));
    }
    const Image plain = DrawContactSheet(sheet);
    EXPECT_EQ(plain.width, 1600);
    EXPECT_GT(plain.height, 200);
    EXPECT_LT(plain.height, 2400);
    EXPECT_GT(CountOrange(plain), 1000) << "the chosen view has no frame";
    sheet.set_aside = {View("cap.jpg", 200, 150), {Image(), "torn.jpg", "blank", false}};
    sheet.set_aside_left_out = 3;
    EXPECT_GT(DrawContactSheet(sheet).height, plain.height);
  }
}

TEST(ContactSheetTest, DrawsNoFrameWithoutChosenView) {
  const ContactSheet sheet{"", "", {View("a", 1, 1), View("b", 3000, 1)}, 0, {}, 0};
  EXPECT_EQ(CountOrange(DrawContactSheet(sheet)), 0);
  EXPECT_THROW(DrawContactSheet({}), Error);
}

}  // namespace
}  // namespace color3d
