#include "client/studio/correct/scene_views.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace {

constexpr int kWidth = 2400, kHeight = 1600;

class SceneViewsTest : public ::testing::Test {
 protected:
  SceneViews Views(double k1) {
    Scene scene;
    View view;
    view.name = "a.png";
    view.image_file = "images/a.png";
    view.captured_camera = {kWidth, kHeight, 2000.0, 2000.0, kWidth / 2.0, kHeight / 2.0};
    view.camera = view.captured_camera;
    if (k1 != 0.0) {
      view.distortion.model = Distortion::Model::kBrown;
      view.distortion.k[0] = k1;
      view.camera.fx = view.camera.fy = 2300.0;
    }
    scene.views.push_back(view);
    return {scene, scratch_.path(), [this](const std::string& name) {
              ++fetched_;
              if (name != "images/a.png") throw Error(ErrorCode::kNotFound, "no {}", name);
              std::filesystem::create_directories(scratch_.path() / "images");
              Image photo(kWidth, kHeight, 3, 0.5f);
              std::fill_n(photo.Plane(0), photo.PlaneSize(), 0.9f);
              WriteFileAtomic(scratch_.path() / name, EncodeJpeg(photo));
            }};
  }

  const ScratchFolder scratch_;
  int fetched_ = 0;
};

TEST_F(SceneViewsTest, PhotosAreGrayAtScreenSize) {
  const SceneViews views = Views(0.0);
  EXPECT_EQ(views.Facts().dump(),
            R"([{"name":"a.png","width":1200,"height":800,"photo_width":2400,"held_out":false}])");
  for (const int side : {0, 240}) {
    const Image jpeg = DecodeImage(views.Jpeg(0, side), "a.jpg");
    EXPECT_EQ(jpeg.width, side == 0 ? 1200 : 240);
    EXPECT_TRUE(IsGray(jpeg));
  }
  EXPECT_EQ(views.Find("a.png"), 0);
  EXPECT_THROW(views.Find("a"), Error);
}

TEST_F(SceneViewsTest, StrokesGoToThePhotoAsCaptured) {
  const auto strokes = nlohmann::json::parse(
      R"([{"x": 600, "y": 400, "radius": 6, "color": "#a0522d"},
          {"line": [[0, 0], [1199, 799]], "width": 10, "keep": "neutral"}])");
  const auto plain = Views(0.0).CapturedStrokes(0, strokes);
  EXPECT_EQ(plain[0].dump(), R"({"color":"#a0522d","radius":12.0,"x":1200.0,"y":800.0})");
  EXPECT_NEAR(plain[1]["line"][1][0].get<double>(), 2398.0, 0.01);
  EXPECT_EQ(plain[1]["width"], 20.0);
  EXPECT_EQ(plain[1]["keep"], "neutral");
  // The middle stays where the lens bends the rest inwards.
  const auto bent = Views(-0.2).CapturedStrokes(0, strokes);
  EXPECT_NEAR(bent[0]["x"].get<double>(), 1200.0, 1e-6);
  EXPECT_GT(bent[1]["line"][0][0].get<double>(), 50.0);
}

TEST_F(SceneViewsTest, RefusesStrokesThatAreNone) {
  const SceneViews views = Views(0.0);
  for (const char* bad : {"[]",
                          "{}",
                          "[3]",
                          R"([{"x": 1, "y": 1}])",
                          R"([{"x": 1, "y": 1, "color": 5}])",
                          R"([{"x": 1, "y": 1, "color": "#000000", "keep": "neutral"}])",
                          R"([{"x": "1", "y": 1, "color": "#000000"}])",
                          R"([{"x": 1300, "y": 1, "color": "#000000"}])",
                          R"([{"x": 1e300, "y": 1, "color": "#000000"}])",
                          R"([{"line": [], "color": "#000000"}])",
                          R"([{"line": [[1]], "color": "#000000"}])",
                          R"([{"line": [[1, "2"]], "color": "#000000"}])"}) {
    EXPECT_THROW(views.CapturedStrokes(0, nlohmann::json::parse(bad)), Error) << bad;
  }
  EXPECT_EQ(fetched_, 0);
}

}  // namespace
}  // namespace color3d::client
