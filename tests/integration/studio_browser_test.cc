// The studio in a real browser, on a rendered room: from a folder to the coloured scene, with the
// stroke of a finger.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

bool IsInstalled(const std::string& program, const ScratchFolder& scratch) {
  return RunProcess({"env", program, "--version"}, scratch.path() / "log", seconds(30)).exit_code ==
         0;
}

class StudioTest : public ServiceTest {
 protected:
  void SetUp() override {
    if (!IsInstalled("chromium", folder_)) GTEST_SKIP() << "skipped, because there is no Chromium";
    if (!IsInstalled("node", folder_)) GTEST_SKIP() << "skipped, because there is no Node";
    ::setenv("XDG_DATA_HOME", Path("home").c_str(), 1);
    StartServer();
  }
  // Returns the address that the studio prints.
  std::string AddressOf(Process& studio) {
    EXPECT_TRUE(
        WaitUntil([&] { return studio.Out().find('\n') != std::string::npos; }, seconds(30)))
        << studio.Err();
    const std::string out = studio.Out();
    return out.substr(0, out.find('\n'));
  }
};

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

}  // namespace
}  // namespace color3d
