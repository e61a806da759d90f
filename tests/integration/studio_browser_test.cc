// The studio in a real browser, on a rendered room: from a folder to the coloured scene, with the
// stroke of a finger.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "tests/integration/studio_fixture.h"

namespace color3d {
namespace {
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(StudioTest, FolderBecomesColoredScene) {
  WriteProceduralScene(Path("room"), SmallRoom(8, /*gray=*/true));
  std::filesystem::remove_all(Path("room") / "truth");
  Process studio(ClientCommand({"studio", "--no-open"}), Path("studio"));
  const char* screenshots = std::getenv("COLOR3D_SCREENSHOTS");
  std::vector<std::string> command = {
      "node", COLOR3D_USE_STUDIO, "chromium", AddressOf(studio), Path("room")};
  if (screenshots != nullptr) command.emplace_back(screenshots);
  const ProcessResult used = RunProcess(command, Path("browser"), seconds(400));
  ASSERT_EQ(used.exit_code, 0) << used.err << studio.Err();
  const auto seen = nlohmann::json::parse(used.out);
  EXPECT_THAT(seen.at("errors"), IsEmpty()) << seen.at("errors");
  EXPECT_THAT(seen.at("requests"), IsEmpty()) << seen.at("requests");
  EXPECT_THAT(seen.at("wide"), IsEmpty()) << seen.at("wide");
  EXPECT_THAT(seen.at("faint"), IsEmpty()) << seen.at("faint");
  EXPECT_TRUE(seen.at("shades").get<bool>());
  const auto text = [&](const char* page) { return seen.at("texts").at(page).get<std::string>(); };
  EXPECT_THAT(text("photos"), HasSubstr("8 photos"));
  EXPECT_THAT(text("photos"), HasSubstr("240 × 180"));
  EXPECT_THAT(text("photos"), HasSubstr("monochrome"));
  EXPECT_THAT(text("photos"), HasSubstr("in the folder"));
  EXPECT_THAT(text("key"), HasSubstr("Proposed: view00"));
  EXPECT_THAT(text("key"), HasSubstr("Expected colour error"));
  EXPECT_THAT(text("running"), HasSubstr("First colours"));
  EXPECT_THAT(text("again"), HasSubstr("room"));
  EXPECT_THAT(text("again"), HasSubstr("being coloured"));
  EXPECT_THAT(text("done"), HasSubstr("view.html"));
  // The same job as on the command line, with the stroke of a finger above automatic colours.
  const v1::Job run = NewestJob("colorize_scene");
  EXPECT_EQ(run.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_TRUE(run.spec().colorize_scene().key_color().automatic());
  EXPECT_TRUE(run.spec().colorize_scene().key_color().backend_input().has_points());
  studio.Signal(SIGINT);
  EXPECT_EQ(studio.Wait(seconds(10)), 0) << studio.Err();
}

TEST_F(StudioTest, SceneIsCorrected) {
  WriteProceduralScene(Path("room"), SmallRoom(8, /*gray=*/true));
  const std::string key = Path("room") / "truth" / "view001.png";
  const std::vector<std::string> colorize = {
      "colorize", Path("room"), "-o", Path("out"), "--key-view", "view001.png", "--key-color", key};
  const ProcessResult colored = Client(colorize + QuickOptions());
  ASSERT_EQ(colored.exit_code, 0) << colored.out << colored.err;
  Process studio(ClientCommand({"studio", "--no-open", Path("out")}), Path("studio"));
  const char* screenshots = std::getenv("COLOR3D_SCREENSHOTS");
  std::vector<std::string> command = {"node", COLOR3D_USE_CORRECTOR, "chromium", AddressOf(studio)};
  if (screenshots != nullptr) command.emplace_back(screenshots);
  const ProcessResult used = RunProcess(command, Path("browser"), seconds(500));
  ASSERT_EQ(used.exit_code, 0) << used.err << studio.Err();
  const auto seen = nlohmann::json::parse(used.out);
  SCOPED_TRACE(seen.dump(1));
  for (const char* none : {"errors", "requests", "wide", "faint"}) {
    EXPECT_THAT(seen.at(none), IsEmpty()) << none;
  }
  const auto color = [&](const char* when) {
    return seen.at("colors").at(when).get<std::array<int, 3>>();
  };
  const auto redness = [](const std::array<int, 3>& rgb) { return rgb[0] - rgb[1]; };
  EXPECT_GT(redness(color("after")), redness(color("before")) + 15) << "the stroke is red";
  EXPECT_THAT(seen.at("touches").get<std::string>(), HasSubstr("of 8 photos"));
  EXPECT_NE(seen.at("touches"), seen.at("touches_less")) << "the reach counts";
  EXPECT_TRUE(seen.at("other_page_followed").get<bool>());
  EXPECT_THAT(seen.at("left_over").get<std::string>(), HasSubstr("Blue on"));
  const auto spread = [](const std::array<int, 3>& rgb) {
    return std::max({rgb[0], rgb[1], rgb[2]}) - std::min({rgb[0], rgb[1], rgb[2]});
  };
  EXPECT_LE(spread(color("gray")), 6 + spread(color("gray_before")) / 3);
  EXPECT_TRUE(seen.at("scene_click").get<bool>());
  studio.Signal(SIGINT);
  EXPECT_EQ(studio.Wait(seconds(10)), 0) << studio.Err();
}

}  // namespace
}  // namespace color3d
