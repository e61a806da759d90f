#include "core/colorizer/personal/scene_colorizers.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

TEST(SceneColorizersTest, NamesUnknownSceneBeforeComputing) {
  const Image luminance(96, 64, 1, 50.0f);
  const std::vector<RoutedPicture> pictures = {{"scenes/lost", &luminance}};
  try {
    ColorizeRouted(pictures, [](const std::string&) { return nullptr; });
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_NE(std::string(error.what()).find("scenes/lost"), std::string::npos);
  }
}

}  // namespace
}  // namespace color3d
