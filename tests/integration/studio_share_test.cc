// Sharing a scene and the queue of the studio in a real browser, on rendered rooms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <thread>

#include "core/image/credit/picture_credit.h"
#include "core/image/probe/probe.h"
#include "core/zip/zip.h"
#include "tests/integration/studio_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::SizeIs;

constexpr char kCredit[] =
    "Coloured by Erika Müller. Original: Stadtarchiv, 7. Licence: CC BY 4.0. Colours are inferred.";

class StudioShareTest : public StudioTest {
 protected:
  void MakeRoom() {
    WriteProceduralScene(Path("room"), SmallRoom(8, /*gray=*/true));
    fs::remove_all(Path("room") / "truth");
  }
};

TEST_F(StudioShareTest, SceneIsSavedWithItsCredit) {
  MakeRoom();
  Process studio(ClientCommand({"studio", "--no-open", Path("room")}), Path("studio"));
  const fs::path out = Path("saved");
  const auto seen = Use(COLOR3D_SHARE_SCENE, {AddressOf(studio), out});
  ASSERT_TRUE(seen.is_object());
  for (const char* list : {"errors", "requests", "wide", "faint"}) {
    EXPECT_THAT(seen.at(list), IsEmpty()) << seen.at(list);
  }
  // A key photo in colour and in grey, and all photos.
  EXPECT_EQ(seen.at("figures"), 10);
  EXPECT_EQ(seen.at("failed"), 0);

  const std::string key = ReadFile(out / "key_view_colored.png");
  EXPECT_THAT(ReadPictureTexts(key, "key"), Contains(Pair("Description", kCredit)));
  EXPECT_GT(ProbeImage(key, "key").height, 180) << "a caption";
  const std::string packed = ReadFile(out / "room_coloured.zip");
  const MemorySource source(packed);
  const ZipReader zip(source);
  EXPECT_THAT(zip.records(), SizeIs(8));
  const std::string photo = zip.Read("view003_coloured.jpg", 1 << 24);
  EXPECT_THAT(ReadPictureTexts(photo, "photo"), Contains(Pair("2:120", kCredit)));
  for (const char* file : {"scene.spz", "scene.mp4", "side_by_side.mp4"}) {
    EXPECT_GT(fs::file_size(out / file), 1000u) << file;
  }
  // A4, in points, and as many pages as on the screen.
  const std::string pdf = ReadFile(out / "sheet.pdf");
  const std::regex page("/Type\\s*/Page[^s]"), a4("/MediaBox\\s*\\[0 0 59[45]\\.?[0-9]* 84[12]");
  const auto count = [&](const std::regex& what) {
    return std::distance(std::sregex_iterator(pdf.begin(), pdf.end(), what),
                         std::sregex_iterator());
  };
  EXPECT_EQ(count(page), seen.at("pages"));
  EXPECT_EQ(count(a4), seen.at("pages"));
}

TEST_F(StudioShareTest, QueueKeepsItsOrderAndItsRuns) {
  // The first run takes longer than the page's script needs to change the order.
  ProceduralSceneOptions room = SmallRoom(8, /*gray=*/true);
  room.width = 400;
  room.height = 300;
  WriteProceduralScene(Path("room"), room);
  fs::remove_all(Path("room") / "truth");
  Process studio(ClientCommand({"studio", "--no-open"}), Path("studio"));
  const auto seen = Use(COLOR3D_ORDER_QUEUE, {AddressOf(studio), Path("room")});
  ASSERT_TRUE(seen.is_object());
  for (const char* list : {"errors", "requests", "wide", "faint"}) {
    EXPECT_THAT(seen.at(list), IsEmpty()) << seen.at(list);
  }
  EXPECT_THAT(seen.at("before"), ElementsAre("one", "two", "three", "four"));
  EXPECT_THAT(seen.at("after"), ElementsAre("one", "four", "two", "three"));
  EXPECT_EQ(seen.at("moved"), true) << "a page of the moved run follows it";
  EXPECT_THAT(seen.at("left"),
              testing::AnyOf(ElementsAre("one", "four", "three"), ElementsAre("four", "three")));
  // The browser and the studio end in the middle of a run; nothing is lost.
  studio.Signal(SIGKILL);
  studio.Wait(seconds(10));
  Process again(ClientCommand({"studio", "--no-open"}), Path("studio_again"));
  AddressOf(again);
  EXPECT_TRUE(WaitUntil(
      [&] {
        int done = 0;
        for (const v1::Job& job : server().ListJobs()) {
          done += job.kind() == "colorize_scene" && job.state() == v1::Job::STATE_SUCCEEDED ? 1 : 0;
        }
        return done == 3;
      },
      seconds(400)));
}

TEST_F(StudioShareTest, PageGoesOnWhenTheServiceComesBack) {
  MakeRoom();
  Process studio(ClientCommand({"studio", "--no-open", Path("room")}), Path("studio"));
  const fs::path mark = Path("mark");
  std::vector<std::string> command = {
      "node", COLOR3D_LOSE_SERVICE, "chromium", AddressOf(studio), mark};
  if (const char* screenshots = std::getenv("COLOR3D_SCREENSHOTS")) {
    command.emplace_back(screenshots);
  }
  Process page(command, Path("page"));
  ASSERT_TRUE(WaitUntil([&] { return fs::exists(mark); }, seconds(180))) << page.Err();
  const std::string address = server().address();
  StopServer();
  std::this_thread::sleep_for(seconds(15));
  StartServer({}, address);
  const auto ended = page.Wait(seconds(300));
  ASSERT_TRUE(ended.has_value() && *ended == 0) << page.Err();
  const auto seen = nlohmann::json::parse(page.Out());
  EXPECT_EQ(seen.at("second"), 200);
  EXPECT_EQ(seen.at("done"), true);
}

// Other users see the arguments of every program.
TEST_F(StudioShareTest, AddressStandsInNoArguments) {
  MakeRoom();
  const fs::path bin = Path("bin"), runtime = Path("runtime");
  fs::create_directories(bin);
  fs::create_directories(runtime);
  fs::permissions(runtime, fs::perms::owner_all);
  std::ofstream(bin / "xdg-open") << "#!/bin/sh\necho \"$@\" > " << (Path("arguments")).string()
                                  << "\nstat -c %a \"$1\" >> " << Path("arguments").string()
                                  << "\ncat \"$1\" > " << Path("page").string() << "\n";
  fs::permissions(bin / "xdg-open", fs::perms::owner_all);
  auto command = ClientCommand({"studio", Path("room")});
  command.insert(command.begin(),
                 {"env",
                  "DISPLAY=:1",
                  "XDG_RUNTIME_DIR=" + runtime.string(),
                  "PATH=" + bin.string() + ":" + std::getenv("PATH")});
  Process studio(command, Path("studio"));
  const std::string address = AddressOf(studio);
  const std::string token = address.substr(address.find("token=") + 6, 64);
  const std::string arguments = ReadFile(Path("arguments"));
  EXPECT_THAT(arguments, HasSubstr(runtime.string()));
  EXPECT_THAT(arguments, HasSubstr("\n600\n"));
  EXPECT_THAT(arguments, testing::Not(HasSubstr(token)));
  EXPECT_THAT(ReadFile(Path("page")), HasSubstr(token));
  // The file goes away once the browser is in.
  EXPECT_FALSE(fs::is_empty(runtime));
  RunProcess({"node", "-e", "fetch(process.argv[1])", address}, Path("fetch"), seconds(30));
  EXPECT_TRUE(WaitUntil([&] { return fs::is_empty(runtime); }, seconds(10)));
}

}  // namespace
}  // namespace color3d
