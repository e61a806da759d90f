// `color3d key`: select, colour, look, accept, then colour the scene with what was accepted.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class KeyTest : public ServiceTest {
 protected:
  void SetUp() override {
    StartServer();
    WriteProceduralScene(Path("room"), SmallRoom(6, /*gray=*/true));
  }
  // The command's answer as JSON; it must succeed.
  json Ask(const std::vector<std::string>& arguments) {
    const ProcessResult result = Client(arguments + std::vector<std::string>{"--json"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    return json::parse(result.out, nullptr, /*allow_exceptions=*/false);
  }
  int CountJobs(const std::string& kind) const {
    const auto jobs = const_cast<KeyTest*>(this)->server().ListJobs();
    return static_cast<int>(std::count_if(
        jobs.begin(), jobs.end(), [&](const v1::Job& job) { return job.kind() == kind; }));
  }
};

TEST_F(KeyTest, SelectColourLookAcceptAndColourTheSceneWithoutDoingItAgain) {
  const std::string out = Path("key").string();
  const ProcessResult select = Client({"key", "select", Path("room").string(), "-o", out});
  ASSERT_EQ(select.exit_code, 0) << select.out << select.err;
  EXPECT_NE(select.out.find("Best of "), std::string::npos) << select.out;
  EXPECT_NE(select.out.find("key colour scenes/"), std::string::npos)
      << "it does not say what next";
  EXPECT_TRUE(IsGray(ReadImage(Path("key") / "key_view.png")));
  EXPECT_EQ(ReadImage(Path("key") / "key_view_ranking.jpg").width, 1600);

  const std::string scene = NewestJob("select_key_view").spec().scene();
  const std::string view = json::parse(ReadFile(Path("key") / "key_view.json")).at("view");
  const fs::path painted = Path("painted.png");
  fs::copy_file(Path("room") / "truth" / view, painted);
  const json coloured = Ask({"key", "colour", scene, "--image", painted.string(), "-o", out});
  EXPECT_EQ(coloured.at("key_view"), view);
  EXPECT_FALSE(IsGray(ReadImage(Path("key") / "key_view_colored.png")));
  const json shown = Ask({"key", "show", scene});
  EXPECT_EQ(shown.at("coloured"), coloured.at("job"));
  EXPECT_TRUE(shown.at("accepted").is_null());

  EXPECT_EQ(Ask({"key", "accept", scene}).at("job"), coloured.at("job"));
  EXPECT_EQ(Ask({"key", "show", scene}).at("accepted"), coloured.at("job"));
  const ProcessResult done =
      Client(std::vector<std::string>{"colorize", "--scene", scene, "-o", Path("out").string()} +
             QuickOptions());
  ASSERT_EQ(done.exit_code, 0) << done.out << done.err;
  EXPECT_TRUE(fs::is_regular_file(Path("out") / "scene.ply"));
  EXPECT_EQ(ReadFile(Path("out") / "key_view_colored.png"),
            ReadFile(Path("key") / "key_view_colored.png"));
  EXPECT_NE(ReadFile(Path("out") / "report.html").find("Best of "), std::string::npos);
  EXPECT_EQ(CountJobs("select_key_view"), 1);
  EXPECT_EQ(CountJobs("colorize_key_view"), 1) << "the accepted colour was computed again";
}

TEST_F(KeyTest, AnotherViewAndAnOlderColourCanBeTaken) {
  const std::string room = Path("room").string(), out = Path("key").string();
  WriteFileAtomic(Path("hints.json"), R"([{"x": 60, "y": 30, "radius": 4, "color": "#2f6f7f"}])");
  const auto colour = [&](const std::string& view) {
    return Ask(
        {"key", "colour", room, "--view", view, "--hints", Path("hints.json").string(), "-o", out});
  };
  const json first = colour("view002");
  EXPECT_EQ(first.at("key_view"), "view002.png");
  const json second = colour("view004");
  const std::string scene = second.at("scene");
  EXPECT_EQ(Ask({"key", "accept", scene, "--job", first.at("job")}).at("key_view"), "view002.png");
  EXPECT_EQ(Ask({"key", "accept", scene}).at("key_view"), "view004.png");
  // Without --view the colour goes with the newest selection.
  Ask({"key", "select", scene, "--view", "view001", "-o", out});
  EXPECT_EQ(Ask({"key", "colour", scene, "--hints", Path("hints.json").string(), "-o", out})
                .at("key_view"),
            "view001.png");
}

TEST_F(KeyTest, EveryStrategySharesTheFeaturesOfTheFirst) {
  const std::string room = Path("room").string(), out = Path("key").string();
  Ask({"key", "select", room, "-o", out});
  const fs::path cache = Path("server") / "data" / "cache" / "view_features";
  const std::vector<std::string> entries = ListFiles(cache);
  EXPECT_EQ(entries.size(), 6u);
  for (const char* strategy : {"entropy", "tracks"}) {
    const json answer = Ask({"key", "select", room, "--strategy", strategy, "-o", out});
    EXPECT_NE(answer.at("description").get<std::string>().find("Best of "), std::string::npos);
  }
  EXPECT_EQ(ListFiles(cache), entries);
}

TEST_F(KeyTest, RefusalsSayWhatToDo) {
  ExpectRefusal(Client({"key", "accept", "scenes/nothing"}), 2, {"scenes/nothing"});
  ExpectRefusal(Client({"key", "select", "no such folder"}), 2, {"neither a folder", "scene list"});
  const std::string room = Path("room").string();
  ExpectRefusal(Client({"key", "colour", room}), 2, {"--auto", "--image"});
  const std::string scene = Ask({"key", "show", room}).at("scene");
  ExpectRefusal(Client({"key", "accept", scene}), 2, {"key colour"});
  ExpectRefusal(
      Client({"colorize", "--scene", scene, "-o", Path("out").string()}), 2, {"key accept"});
  ExpectRefusal(Client({"key", "select", room, "--view", "view999", "-o", Path("k").string()}),
                2,
                {"view999"});
}

}  // namespace
}  // namespace color3d
