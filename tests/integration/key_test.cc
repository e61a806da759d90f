// `color3d key`: selects, colours and accepts a key view, then colours the scene with it.
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
  // Runs a command, which must succeed, and returns its JSON.
  json RunJson(const std::vector<std::string>& arguments) {
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

TEST_F(KeyTest, AcceptedKeyViewIsNotColoredAgain) {
  const std::string out = Path("key").string();
  const ProcessResult select = Client({"key", "select", Path("room").string(), "-o", out});
  ASSERT_EQ(select.exit_code, 0) << select.out << select.err;
  EXPECT_NE(select.out.find("Best of "), std::string::npos) << select.out;
  EXPECT_NE(select.out.find("key color scenes/"), std::string::npos)
      << "the next command is not printed";
  EXPECT_TRUE(IsGray(ReadImage(Path("key") / "key_view.png")));
  EXPECT_EQ(ReadImage(Path("key") / "key_view_ranking.jpg").width, 1600);

  const std::string scene = NewestJob("select_key_view").spec().scene();
  const std::string view = json::parse(ReadFile(Path("key") / "key_view.json")).at("view");
  const fs::path painted = Path("painted.png");
  fs::copy_file(Path("room") / "truth" / view, painted);
  const json colored = RunJson({"key", "color", scene, "--image", painted.string(), "-o", out});
  EXPECT_EQ(colored.at("key_view"), view);
  EXPECT_FALSE(IsGray(ReadImage(Path("key") / "key_view_colored.png")));
  const json shown = RunJson({"key", "show", scene});
  EXPECT_EQ(shown.at("colored"), colored.at("job"));
  EXPECT_TRUE(shown.at("accepted").is_null());

  EXPECT_EQ(RunJson({"key", "accept", scene}).at("job"), colored.at("job"));
  EXPECT_EQ(RunJson({"key", "show", scene}).at("accepted"), colored.at("job"));
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

  const std::string other = view == "view001.png" ? "view004.png" : "view001.png";
  const ProcessResult more = Client({"colorize",
                                     "--scene",
                                     scene,
                                     "--add-key-view",
                                     other + "=" + (Path("room") / "truth" / other).string(),
                                     "-o",
                                     Path("more").string(),
                                     "--detach"});
  ASSERT_EQ(more.exit_code, 0) << more.out << more.err;
  const v1::ColorizeSceneSpec spec = NewestJob("colorize_scene").spec().colorize_scene();
  EXPECT_EQ(spec.carry_color().further_key_views_size(), 1) << "--add-key-view had no effect";
  const v1::Job additional = NewestJob("colorize_key_view");
  EXPECT_EQ(additional.spec().colorize_key_view().view(), other);
  ExpectRefusal(Client({"key", "accept", scene, "--job", additional.name()}),
                2,
                {"additional key view", other});
}

TEST_F(KeyTest, AcceptsAnotherViewAndAnOlderColor) {
  const std::string room = Path("room").string(), out = Path("key").string();
  WriteFileAtomic(Path("hints.json"), R"([{"x": 60, "y": 30, "radius": 4, "color": "#2f6f7f"}])");
  const auto color = [&](const std::string& view) {
    return RunJson(
        {"key", "color", room, "--view", view, "--hints", Path("hints.json").string(), "-o", out});
  };
  const json first = color("view002");
  EXPECT_EQ(first.at("key_view"), "view002.png");
  const json second = color("view004");
  const std::string scene = second.at("scene");
  EXPECT_EQ(RunJson({"key", "accept", scene, "--job", first.at("job")}).at("key_view"),
            "view002.png");
  EXPECT_EQ(RunJson({"key", "accept", scene}).at("key_view"), "view004.png");
  // Without --view the colour belongs to the newest selection.
  RunJson({"key", "select", scene, "--view", "view001", "-o", out});
  EXPECT_EQ(RunJson({"key", "color", scene, "--hints", Path("hints.json").string(), "-o", out})
                .at("key_view"),
            "view001.png");
}

TEST_F(KeyTest, StrategiesShareFeatures) {
  const std::string room = Path("room").string(), out = Path("key").string();
  RunJson({"key", "select", room, "-o", out});
  const fs::path cache = Path("server") / "data" / "cache" / "view_features";
  const std::vector<std::string> entries = ListFiles(cache);
  EXPECT_EQ(entries.size(), 6u);
  for (const char* strategy : {"entropy", "tracks"}) {
    const json answer = RunJson({"key", "select", room, "--strategy", strategy, "-o", out});
    EXPECT_NE(answer.at("description").get<std::string>().find("Best of "), std::string::npos);
  }
  EXPECT_EQ(ListFiles(cache), entries);
}

TEST_F(KeyTest, RefusalsNameTheRemedy) {
  ExpectRefusal(Client({"key", "accept", "scenes/nothing"}), 2, {"scenes/nothing"});
  ExpectRefusal(Client({"key", "select", "no such folder"}), 2, {"neither a folder", "scene list"});
  const std::string room = Path("room").string();
  ExpectRefusal(Client({"key", "color", room}), 2, {"--auto", "--image"});
  const std::string scene = RunJson({"key", "show", room}).at("scene");
  ExpectRefusal(Client({"key", "accept", scene}), 2, {"key color"});
  ExpectRefusal(
      Client({"colorize", "--scene", scene, "-o", Path("out").string()}), 2, {"key accept"});
  ExpectRefusal(Client({"key", "select", room, "--view", "view999", "-o", Path("k").string()}),
                2,
                {"view999"});
}

}  // namespace
}  // namespace color3d
