// The page in a real browser: headless Chromium without a graphics card, driven by Node.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/splat/export/export.h"
#include "core/splat/export/sog/sog.h"
#include "core/video/mp4_writer.h"
#include "core/view/browser_fixture.h"
#include "core/view/view_page.h"

namespace color3d {
namespace {

constexpr float kShDc = 0.28209479f;

// A wall that the camera sees as two halves: red and seen on its left, blue and guessed on its
// right. Its Gaussians are not in the order of any viewer.
constexpr int kSide = 48;
bool OnTheLeft(int i) { return (i * 37) % kSide < kSide / 2; }

struct Wall {
  GaussianModel model;
  RgbHarmonics rgb;
};

Wall MakeWall() {
  Wall wall;
  GaussianModel& model = wall.model;
  model.channels = 3;
  for (int i = 0; i < kSide * kSide; ++i) {
    const float x = static_cast<float>((i * 37) % kSide) / kSide - 0.48f;
    const float y = static_cast<float>(i / kSide) / kSide - 0.48f;
    model.position.insert(model.position.end(), {4.0f * x, 4.0f * y, 2.0f});
    model.log_scale.insert(model.log_scale.end(), 3, std::log(0.1f));
    model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
    model.opacity_logit.push_back(4.0f);
    for (std::vector<float>* sh : {&model.sh_l, &model.sh_a, &model.sh_b}) sh->push_back(0.0f);
    const float red = OnTheLeft(i) ? 0.9f : 0.1f, blue = OnTheLeft(i) ? 0.1f : 0.9f;
    for (const float value : {red, 0.1f, blue}) wall.rgb.sh.push_back((value - 0.5f) / kShDc);
    model.confidence.push_back(OnTheLeft(i) ? 1.0f : 0.0f);
  }
  return wall;
}

// The wall in this format, with its confidence in the order of the file.
void TakeWall(const std::string& file_name, ViewPage* page) {
  ThreadPool pool(1);
  const Wall wall = MakeWall();
  page->file_name = file_name;
  page->confidence = wall.model.confidence;
  if (file_name.ends_with(".ply")) {
    page->file_bytes = EncodeGaussianPly(wall.model, wall.rgb, {}, pool);
    return;
  }
  const ViewerGaussians gaussians = ForViewers(wall.model, wall.rgb, {}, pool);
  page->file_bytes = EncodeSog(gaussians, pool);
  page->file_is_compressed = true;
  const std::vector<uint32_t> order = SogOrder(gaussians.position);
  for (size_t i = 0; i < order.size(); ++i) {
    page->confidence[i] = wall.model.confidence[order[i]];
  }
}

Scene WallScene() {
  Scene scene;
  for (int i = 0; i < 2; ++i) {
    View view;
    view.name = i == 0 ? "key.jpg" : "side.jpg";
    view.camera = {120, 80, 100.0, 100.0, 60.0, 40.0};
    view.cam_from_world.translation = {0.2 * i, 0.0, 0.0};
    scene.views.push_back(view);
  }
  return scene;
}

std::string PageOfWall(const ScratchFolder& folder,
                       const std::string& file_name,
                       const ViewPageMovie& movie = {}) {
  ViewPage page;
  page.movie = movie;
  TakeWall(file_name, &page);
  page.focus = {0.0, 0.0, 2.0};
  page.poster = EncodeJpeg(Image(120, 80, 3, 0.5f));
  page.photos = {{0, EncodeJpeg(Image(120, 80, 3, 1.0f))},
                 {1, EncodeJpeg(Image(120, 80, 3, 0.0f))}};
  const std::string file = folder.path() / "view.html";
  WriteFileAtomic(file, RenderViewPage(WallScene(), page));
  return file;
}

class BrowserTest : public BrowserFixture {
 protected:
  nlohmann::json Look(const std::string& file_name,
                      const std::vector<std::string>& environment = {},
                      const ViewPageMovie& movie = {}) {
    return RunInBrowser(
        COLOR3D_LOOK_AT_PAGE, PageOfWall(scratch_, file_name, movie), {}, environment);
  }
  // Two seconds of green.
  ViewPageMovie GreenMovie(bool shows_motion) {
    ThreadPool pool(1);
    const auto file = scratch_.path() / "green.mp4";
    Mp4Writer writer(file, {.width = 120, .height = 80, .frames_per_second = 10});
    Image green(120, 80, 3, 0.1f);
    for (int i = 0; i < 120 * 80; ++i) green.data[120 * 80 + i] = 0.8f;
    for (int i = 0; i < 20; ++i) writer.Add(green, pool);
    writer.Finish();
    return {ReadFile(file), false, shows_motion};
  }
};

// red, green, blue of a half in a step, 0..255.
std::array<int, 3> Seen(const nlohmann::json& looked, const char* step, const char* half) {
  return looked.at("seen").at(step).at(half);
}

class BrowserFormatTest : public BrowserTest, public ::testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats,
                         BrowserFormatTest,
                         ::testing::Values("scene.ply", "scene.sog"),
                         [](const auto& format) { return std::string(format.param).substr(6); });

TEST_P(BrowserFormatTest, ShowsColorGrayAndProvenance) {
  const nlohmann::json looked = Look(GetParam());
  SCOPED_TRACE(looked.dump(1));
  ASSERT_EQ(looked.at("state"), "ready");
  EXPECT_TRUE(looked.at("errors").empty());
  EXPECT_TRUE(looked.at("requests").empty());
  for (const char* step : {"color", "back_in_color"}) {
    const auto left = Seen(looked, step, "left"), right = Seen(looked, step, "right");
    EXPECT_NEAR(left[0], 0.9 * 255, 20);
    EXPECT_NEAR(left[2], 0.1 * 255, 20);
    EXPECT_NEAR(right[0], 0.1 * 255, 20);
    EXPECT_NEAR(right[2], 0.9 * 255, 20);
  }
  for (const char* half : {"left", "right"}) {
    const auto gray = Seen(looked, "gray", half);
    EXPECT_NEAR(gray[0], gray[1], 2);
    EXPECT_NEAR(gray[1], gray[2], 2);
    EXPECT_GT(gray[1], 40);
  }
  // Seen colours are green, guessed ones red, per Gaussian.
  const auto seen = Seen(looked, "where_from", "left");
  const auto guessed = Seen(looked, "where_from", "right");
  EXPECT_GT(seen[1], seen[0] + 15);
  EXPECT_GT(guessed[0], guessed[1] + 15);
  // The whole photo over the scene: white.
  for (const char* half : {"left", "right"}) EXPECT_GT(Seen(looked, "photo", half)[1], 245);
}

TEST_F(BrowserTest, ShowsPictureWithoutWebGl) {
  const nlohmann::json looked = Look("scene.sog", {"COLOR3D_BROWSER_FLAGS=--disable-3d-apis"});
  SCOPED_TRACE(looked.dump(1));
  EXPECT_EQ(looked.at("state"), "failed");
  EXPECT_NE(looked.at("note").get<std::string>().find("WebGL"), std::string::npos);
  EXPECT_NE(looked.at("note").get<std::string>().find("picture"), std::string::npos);
  const auto poster = Seen(looked, "color", "left");
  EXPECT_NEAR(poster[0], 128, 6);
}

TEST_F(BrowserTest, PlaysMovieWithoutWebGl) {
  const nlohmann::json looked =
      Look("scene.sog", {"COLOR3D_BROWSER_FLAGS=--disable-3d-apis"}, GreenMovie(false));
  SCOPED_TRACE(looked.dump(1));
  EXPECT_EQ(looked.at("state"), "failed");
  EXPECT_NE(looked.at("note").get<std::string>().find("movie"), std::string::npos);
  EXPECT_GT(looked.at("movie").at("seconds"), 0.3);
  EXPECT_EQ(looked.at("movie").at("width"), 120);
  const auto green = Seen(looked, "color", "left");
  EXPECT_GT(green[1], green[0] + 80);
}

TEST_F(BrowserTest, SaysWhyMotionOfAFieldDoesNotPlay) {
  const nlohmann::json looked = Look("scene.sog", {}, GreenMovie(true));
  SCOPED_TRACE(looked.dump(1));
  ASSERT_EQ(looked.at("state"), "ready");
  EXPECT_TRUE(looked.at("errors").empty());
  EXPECT_NE(looked.at("note").get<std::string>().find("stands at one moment"), std::string::npos);
  EXPECT_GT(Seen(looked, "film", "left")[1], Seen(looked, "film", "left")[0] + 80);
}

// While a slider moves, a picture of the scene is drawn in the tones; the scene itself follows.
TEST_F(BrowserTest, FramedSceneIsDrawnInTones) {
  const nlohmann::json shown =
      RunInBrowser(COLOR3D_SHOW_TONES, PageOfWall(scratch_, "scene.sog"), {});
  SCOPED_TRACE(shown.dump(1));
  EXPECT_TRUE(shown.at("errors").empty());
  const auto color = [&](const char* tone, const char* when, const char* half) {
    return shown.at("seen").at(tone).at(when).at(half).get<std::array<int, 3>>();
  };
  for (const char* tone : {"plain", "half", "warm", "gray", "again"}) {
    for (const char* half : {"left", "right"}) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(color(tone, "at_once", half)[c], color(tone, "at_rest", half)[c], 6)
            << tone << " " << half << " " << c;
      }
    }
  }
  const auto redness = [&](const char* tone) {
    const auto rgb = color(tone, "at_once", "left");
    return rgb[0] - rgb[2];
  };
  EXPECT_GT(redness("plain"), 180);
  EXPECT_LT(redness("half"), 0.8 * redness("plain"));
  EXPECT_NEAR(redness("gray"), 0, 4);
  EXPECT_GT(redness("again"), 180);
  const auto bluer = [&](const char* tone) {
    const auto rgb = color(tone, "at_once", "right");
    return rgb[2] - rgb[0];
  };
  EXPECT_LT(bluer("warm"), bluer("plain") - 20);
  for (const char* half : {"left", "right"}) {
    const auto moved = shown.at("seen").at("moved").at(half).get<std::array<int, 3>>();
    EXPECT_NEAR(moved[0], moved[2], 4) << "grey after the camera has moved";
  }
  const auto rows = [&](const char* when) {
    return shown.at("seen").at("rows").at(when).get<std::array<int, 8>>();
  };
  int upside_down = 0;
  for (int row = 0; row < 8; ++row) {
    EXPECT_NEAR(rows("at_once")[row], rows("at_rest")[row], 4) << row;
    upside_down = std::max(upside_down, std::abs(rows("at_rest")[row] - rows("at_rest")[7 - row]));
  }
  EXPECT_GT(upside_down, 8) << "the picture tells top from bottom";
}

}  // namespace
}  // namespace color3d
