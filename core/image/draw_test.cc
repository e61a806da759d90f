#include "core/image/draw.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

double Ink(const Image& image) {
  double sum = 0.0;
  for (float value : image.data) sum += value;
  return sum;
}

TEST(DrawTest, ClipsToCanvas) {
  Image canvas(40, 30, 3);
  DrawBox(-5, -5, 10, 10, {1.0f, 0.5f, 0.0f}, &canvas);
  EXPECT_EQ(canvas.At(0, 4, 4), 1.0f);
  EXPECT_EQ(canvas.At(1, 4, 4), 0.5f);
  EXPECT_EQ(canvas.At(0, 5, 5), 0.0f);
  DrawPicture(Image(100, 100, 1, 1.0f), 20, -50, 0.25f, &canvas);
  EXPECT_FLOAT_EQ(canvas.At(2, 0, 39), 0.25f);
  DrawText("a long line of text", -30, 25, 12, {1.0f, 1.0f, 1.0f}, &canvas);
  for (float value : canvas.data) EXPECT_TRUE(value >= 0.0f && value <= 1.0f);
  Image gray(4, 4, 1);
  EXPECT_THROW(DrawBox(0, 0, 1, 1, {}, &gray), Error);
  EXPECT_THROW(DrawPicture(Image(2, 2, 2), 0, 0, 1.0f, &canvas), Error);
}

TEST(DrawTest, TextStaysWithinReportedBounds) {
  Image canvas(200, 40, 3);
  DrawText("IMG_0042.jpg", 10, 10, 12, {1.0f, 1.0f, 1.0f}, &canvas);
  const int width = TextWidth("IMG_0042.jpg", 12);
  EXPECT_GT(width, 60);
  EXPECT_LT(width, 180);
  EXPECT_GT(Ink(canvas), 100.0);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 200; ++x) {
      const bool inside = y >= 6 && y <= 30 && x >= 6 && x <= 14 + width;
      EXPECT_TRUE(inside || canvas.At(0, y, x) == 0.0f) << x << " " << y;
    }
  }
}

TEST(DrawTest, NonAsciiTextBecomesQuestionMarks) {
  EXPECT_EQ(FittingText("caf\xc3\xa9 \xe5\xb1\xb1.png", 12, 1000), "caf? ?.png");
  Image canvas(20, 20, 3);
  DrawText("\xff\xfe\x80", 0, 0, 12, {1.0f, 1.0f, 1.0f}, &canvas);
  DrawText("", 0, 0, 12, {1.0f, 1.0f, 1.0f}, &canvas);
}

TEST(DrawTest, ShortensLongNamesInTheMiddle) {
  const std::string name = "a_very_long_name_of_a_photograph_0042.jpg";
  const std::string shorter = FittingText(name, 12, 150);
  EXPECT_LE(TextWidth(shorter, 12), 150);
  EXPECT_NE(shorter.find("..."), std::string::npos);
  EXPECT_EQ(shorter.substr(shorter.size() - 4), ".jpg");
  EXPECT_EQ(FittingText(name, 12, 3), "");
}

}  // namespace
}  // namespace color3d
