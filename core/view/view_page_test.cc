#include "core/view/view_page.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/text/base64.h"
#include "core/zip/gzip.h"

namespace color3d {
namespace {

std::string Between(const std::string& text, const std::string& begin, const std::string& end) {
  const size_t at = text.find(begin) + begin.size();
  return text.substr(at, text.find(end, at) - at);
}

Scene TwoViews() {
  Scene scene;
  for (int i = 0; i < 2; ++i) {
    View view;
    view.name = i == 0 ? "a</script>.jpg" : "b.jpg";
    view.camera = {60, 40, 50.0, 80.0, 33.0, 20.0};
    view.cam_from_world.translation = {0.1 * i, 0.0, 0.0};
    scene.views.push_back(view);
  }
  return scene;
}

ViewPage SmallPage() {
  ViewPage page;
  page.file_name = "scene.ply";
  page.file_bytes = std::string(5000, 'x');
  page.file_scale = 2.0;
  page.file_offset = {10.0, 0.0, 0.0};
  page.confidence = {0.0f, 0.5f, 1.0f, 2.0f};
  page.key_view = 1;
  page.focus = {0.0, 0.0, 4.0};
  page.poster = "poster";
  page.photos = {{0, "first"}, {1, ""}};
  return page;
}

TEST(ViewPageTest, PageIsSelfContained) {
  if (!HasViewer()) {
    EXPECT_THROW(RenderViewPage(TwoViews(), SmallPage()), Error);
    GTEST_SKIP() << "skipped, because the viewer was left out of this build (no npm)";
  }
  const std::string html = RenderViewPage(TwoViews(), SmallPage());
  EXPECT_EQ(html.find("src=\"http"), std::string::npos);
  EXPECT_EQ(html.find("href=\"http"), std::string::npos);
  EXPECT_NE(html.find(Base64(Gzip(SmallPage().file_bytes))), std::string::npos);
  const auto facts = nlohmann::json::parse(Between(html, "id=\"facts\">", "</script>"));
  EXPECT_EQ(facts.at("scene"), "scene.ply");
  EXPECT_EQ(facts.at("packed"), true);
  EXPECT_EQ(facts.at("key"), 1);
  EXPECT_EQ(facts.at("confidence"), Base64(Gzip(std::string("\x00\x80\xff\xff", 4))));
  EXPECT_NE(facts.at("about").get<std::string>().find("PlayCanvas Ltd"), std::string::npos);
  EXPECT_NE(facts.at("about").get<std::string>().find("MIT License"), std::string::npos);
  const auto& photo = facts.at("photos").at(0);
  EXPECT_EQ(photo.at("name"), "a</script>.jpg");
  EXPECT_EQ(photo.at("jpeg"), Base64("first"));
  EXPECT_DOUBLE_EQ(photo.at("aspect"), 1.5);
  EXPECT_DOUBLE_EQ(photo.at("tan"), 0.25);
  EXPECT_DOUBLE_EQ(photo.at("center").at(0), 0.55);
  // The focus, at (10, 0, 8) in the file, becomes the origin.
  const auto& frame = facts.at("frame");
  const auto& q = frame.at("rotation");
  const Eigen::Quaterniond rotation(q.at(3).get<double>(), q.at(0), q.at(1), q.at(2));
  const auto& p = frame.at("position");
  const Eigen::Vector3d position(p.at(0), p.at(1), p.at(2));
  const double scale = frame.at("scale");
  EXPECT_LT((scale * (rotation * Eigen::Vector3d(10.0, 0.0, 8.0)) + position).norm(), 1e-9);
}

TEST(ViewPageTest, StillScenesHaveNoPlayerAndMovingOnesHave) {
  if (!HasViewer())
    GTEST_SKIP() << "skipped, because the viewer was left out of this build (no npm)";
  ViewPage page = SmallPage();
  const std::string still = RenderViewPage(TwoViews(), page);
  EXPECT_EQ(Between(still, "id=\"motion\">", "</script>"), "");
  EXPECT_EQ(still.find("const color3dPlayer"), std::string::npos);
  EXPECT_EQ(still.find("\"motion\":"), std::string::npos);
  page.motion =
      ViewPageMotion{.file = "moves", .shown_s = 0.5, .seconds = 2.0, .steps = 4, .film = {0, 1}};
  const std::string moving = RenderViewPage(TwoViews(), page);
  EXPECT_EQ(Between(moving, "id=\"motion\">", "</script>"), Base64(Gzip("moves")));
  EXPECT_NE(moving.find("const color3dPlayer"), std::string::npos);
  const auto facts = nlohmann::json::parse(Between(moving, "id=\"facts\">", "</script>"));
  EXPECT_EQ(facts.at("motion").at("shown"), 0.5);
  EXPECT_EQ(facts.at("motion").at("steps"), 4);
  EXPECT_EQ(facts.at("motion").at("film").size(), 2u);
  page.motion->film = {0, 0, 0};  // a camera that stands
  const std::string standing = RenderViewPage(TwoViews(), page);
  EXPECT_EQ(nlohmann::json::parse(Between(standing, "id=\"facts\">", "</script>"))
                .at("motion")
                .at("film")
                .size(),
            1u);
}

TEST(ViewPageTest, KeepsCompressedFileAndNeedsKeyView) {
  if (!HasViewer())
    GTEST_SKIP() << "skipped, because the viewer was left out of this build (no npm)";
  ViewPage page = SmallPage();
  page.file_is_compressed = true;
  page.confidence.clear();
  const std::string html = RenderViewPage(TwoViews(), page);
  EXPECT_EQ(Between(html, "id=\"scene\">", "</script>"), Base64(page.file_bytes));
  const auto facts = nlohmann::json::parse(Between(html, "id=\"facts\">", "</script>"));
  EXPECT_EQ(facts.at("confidence"), "");
  page.photos.pop_back();
  EXPECT_THROW(RenderViewPage(TwoViews(), page), Error);
}

}  // namespace
}  // namespace color3d
