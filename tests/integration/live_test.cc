// Live colouring with real programs: preview without training, and personalized colorizers.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class LiveTest : public ServiceTest {
 protected:
  void SetUp() override {
    StartServer();
    WriteProceduralScene(Path("room"), SmallRoom(8, /*gray=*/true));
  }
  json RunJson(const std::vector<std::string>& arguments) {
    const ProcessResult result = Client(arguments + std::vector<std::string>{"--json"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    return json::parse(result.out, nullptr, /*allow_exceptions=*/false);
  }
  // A scene with a colorizer of a few iterations.
  std::string Personalize() {
    const json colored = RunJson({"key",
                                  "color",
                                  Path("room").string(),
                                  "--view",
                                  "view003",
                                  "--hints",
                                  Hints(),
                                  "-o",
                                  Path("key").string()});
    v1::JobSpec spec;
    spec.set_scene(colored.at("scene"));
    spec.mutable_personalize()->set_iterations(3);
    spec.add_inputs(colored.at("job"));
    for (const v1::Job& job : server().ListJobs()) {
      if (job.name() != colored.at("job")) spec.add_inputs(job.name());
    }
    RunJob(spec);
    return colored.at("scene");
  }
  std::string Hints() {
    WriteFileAtomic(Path("hints.json"), R"([{"x": 60, "y": 30, "radius": 4, "color": "#2f6f7f"}])");
    return Path("hints.json").string();
  }
};

TEST_F(LiveTest, PreviewColorsPhotosWithoutAJob) {
  const std::string key = (Path("room") / "truth" / "view003.png").string();
  const json answer =
      RunJson({"preview", Path("room").string(), "--key-color", key, "-o", Path("out").string()});
  EXPECT_EQ(answer.at("files").size(), 5u);
  EXPECT_EQ(answer.at("colorizer"), "");
  for (const auto& name : answer.at("files")) {
    EXPECT_NE(name, "view003.png") << "the key view is among the previews";
    const Image colored = ReadImage(Path("out") / name);
    const Image photo = ReadImage(Path("room") / "images" / name);
    EXPECT_FALSE(IsGray(colored)) << name;
    EXPECT_EQ(colored.width, photo.width);
  }
  EXPECT_TRUE(server().ListJobs().empty());
  const json again =
      RunJson({"preview", Path("room").string(), "--key-color", key, "-o", Path("out").string()});
  EXPECT_LT(again.at("seconds"), 10.0);
  const std::vector<pid_t> family = Descendants(server().pid());
  EXPECT_EQ(family.size(), 2u) << "expected a worker for jobs and the inference worker";
  EXPECT_EQ(server().Stop(), 0);
  for (const pid_t pid : family) EXPECT_FALSE(IsAlive(pid)) << "left behind";
}

TEST_F(LiveTest, PersonalizedColorizerColorsOtherPhotos) {
  const std::string scene = Personalize();
  const json list = RunJson({"colorizer", "list"});
  ASSERT_EQ(list.at("colorizers").size(), 1u);
  const std::string name = list.at("colorizers")[0].at("name");
  EXPECT_EQ(RunJson({"colorizer", "show", name}).at("scene"), scene);
  const std::string photos = Path("room").string();
  const json by_scene = RunJson({"colorizer", "apply", scene, photos, "-o", Path("a").string()});
  const json by_name = RunJson({"colorizer", "apply", name, photos, "-o", Path("b").string()});
  EXPECT_EQ(by_scene.at("colorizer"), name);
  EXPECT_EQ(by_scene.at("encoder_digest").get<std::string>().size(), 64u);
  ASSERT_EQ(by_scene.at("files").size(), 8u);
  for (const auto& file : by_scene.at("files")) {
    EXPECT_EQ(ReadFile(Path("a") / file), ReadFile(Path("b") / file)) << file;
    EXPECT_FALSE(IsGray(ReadImage(Path("a") / file))) << file;
  }
  // The scene's own key view and photos are not uploaded again.
  const json preview = RunJson({"preview", scene, "-o", Path("c").string(), "--count", "3"});
  EXPECT_EQ(preview.at("files").size(), 3u);
}

TEST_F(LiveTest, RefusalsNameTheRemedy) {
  const std::string room = Path("room").string(), out = Path("out").string();
  ExpectRefusal(Client({"colorizer", "apply", "scenes/none", room, "-o", out}), 2, {"scenes/none"});
  ExpectRefusal(
      Client({"colorizer", "apply", std::string(64, 'a'), "no photo"}), 2, {"no photo or folder"});
  ExpectRefusal(Client({"preview", room, "-o", out}), 2, {"--key-color"});
  ExpectRefusal(Client({"preview", room, "--key-color", room + "/images/view000.png", "-o", out}),
                2,
                {"has no colour"});
  const std::string scene = RunJson({"scene", "create", room}).at("name");
  ExpectRefusal(Client({"preview", scene, "-o", out}), 2, {"key color"});
  ExpectRefusal(
      Client({"colorizer", "apply", scene, room, "-o", out}), 2, {"has no colorizer yet"});
  // A bad photo does not prevent the results of the others.
  fs::create_directories(Path("mixed"));
  fs::copy_file(Path("room") / "images" / "view000.png", Path("mixed") / "good.png");
  WriteFileAtomic(Path("mixed") / "bad.png", ReadFile(Path("mixed") / "good.png").substr(0, 1000));
  const std::string key = (Path("room") / "truth" / "view003.png").string();
  ExpectRefusal(Client({"preview", Path("mixed").string(), "--key-color", key, "-o", out}),
                2,
                {"1 of 2", "bad.png", "truncated"});
  EXPECT_TRUE(fs::exists(Path("out") / "good.png"));
}

}  // namespace
}  // namespace color3d
