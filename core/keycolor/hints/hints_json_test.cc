#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/keycolor/hints/hints.h"

namespace color3d {
namespace {

TEST(HintsJsonTest, ReadsEntries) {
  const std::vector<ColorHint> hints = ParseHintsJson(
      R"([{"x": 120, "y": 80.5, "radius": 3, "color": "#a0522d"}, {"x":0,"y":0,"color":"#FFFFFF"}])");
  ASSERT_EQ(hints.size(), 2u);
  EXPECT_EQ(hints[0].x_px, 120.0);
  EXPECT_EQ(hints[0].y_px, 80.5);
  EXPECT_EQ(hints[0].radius_px, 3.0);
  const LabColor sienna = LabFromSrgb(RgbColor{0xa0 / 255.0, 0x52 / 255.0, 0x2d / 255.0});
  EXPECT_NEAR(hints[0].a, sienna.a, 1e-9);
  EXPECT_NEAR(hints[0].b, sienna.b, 1e-9);
  EXPECT_EQ(hints[1].radius_px, 2.0);
  EXPECT_NEAR(hints[1].a, 0.0, 1e-3);
  EXPECT_EQ(hints[1].reach, 1.0);
  const auto far = ParseHintsJson(R"([{"line":[[1,2],[3,4]],"color":"#ffffff","reach":0.25}])");
  EXPECT_EQ(far.at(0).reach, 0.25);
}

TEST(HintsJsonTest, NamesBadEntry) {
  const std::vector<std::string> bad{"",
                                     "{",
                                     "{}",
                                     "[]",
                                     "[1]",
                                     "null",
                                     R"([{"x":1,"y":1}])",
                                     R"([{"x":1,"color":"#000000"}])",
                                     R"([{"x":"1","y":1,"color":"#000000"}])",
                                     R"([{"x":1,"y":1,"color":"red"}])",
                                     R"([{"x":1,"y":1,"color":"#00000g"}])",
                                     R"([{"x":1,"y":1,"color":7}])",
                                     R"([{"x":-1,"y":1,"color":"#000000"}])",
                                     R"([{"x":1,"y":1,"radius":-2,"color":"#000000"}])",
                                     R"([{"x":1,"y":1,"colour":"#000000","color":"#000000"}])"};
  const std::vector<std::string> bad_shapes{
      R"([{"line":[],"color":"#000000"}])",
      R"([{"line":[[1,2,3]],"color":"#000000"}])",
      R"([{"line":[[1,2]],"radius":3,"color":"#000000"}])",
      R"([{"line":[[1,2]],"width":-1,"color":"#000000"}])",
      R"([{"region":"all","color":"#000000"}])",
      R"([{"region":[[0,0],[1,"a"],[1,1]],"color":"#000000"}])",
      R"([{"label":256,"color":"#000000"}])",
      R"([{"label":1.5,"color":"#000000"}])",
      R"([{"label":1,"x":1,"color":"#000000"}])",
      R"([{"label":1}])",
      R"([{"x":1,"y":1,"reach":0.05,"color":"#000000"}])",
      R"([{"x":1,"y":1,"reach":"far","color":"#000000"}])",
      R"([{"label":1,"keep":"red"}])",
      R"([{"label":1,"keep":"auto","color":"#000000"}])"};
  for (const std::string& json : bad_shapes) EXPECT_THROW(ParseHintsJson(json), Error) << json;
  for (const std::string& json : bad) EXPECT_THROW(ParseHintsJson(json), Error) << json;
  try {
    ParseHintsJson(R"([{"x":1,"y":1,"color":"#000000"},{"x":1,"y":1,"color":"blue"}])");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_NE(std::string(error.what()).find("hint 1"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace color3d
