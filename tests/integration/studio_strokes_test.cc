// Strokes that the studio's page sends and those of the command line: the same bytes, through a
// real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "tests/integration/studio_http_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

// As the painter writes it.
constexpr char kStrokes[] =
    "[\n"
    "{\"line\": [[20, 30.5], [60, 42]], \"width\": 7, \"color\": \"#b5654a\"},\n"
    "{\"x\": 200, \"y\": 150, \"radius\": 4, \"color\": \"#3366cc\"},\n"
    "{\"region\": [[100, 20], [140, 20], [120, 60]], \"keep\": \"auto\"}\n"
    "]\n";
constexpr char kView[] = "view003.png";

class StudioStrokesTest : public StudioHttpTest {
 protected:
  void SetUp() override {
    StudioHttpTest::SetUp();
    WriteFileAtomic(Path("strokes.json"), kStrokes);
  }
  // The picture in full size that the page offers to save.
  std::string FromStudio(json colors) {
    colors["photo"] = kView;
    colors["max_side"] = 0;
    return Post("/preview", colors.dump());
  }
  // The picture that `color3d key color` writes.
  std::string FromCommandLine(const std::vector<std::string>& flags) {
    const fs::path out = Path("out") / std::to_string(++runs_);
    const ProcessResult result =
        Client(std::vector<std::string>{
                   "key", "color", Path("room").string(), "--view", kView, "-o", out.string()} +
               flags);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return ReadFile(out / "key_view_colored.png");
  }
  std::string StrokesFile() const { return Path("strokes.json").string(); }

  int runs_ = 0;
};

TEST_F(StudioStrokesTest, GiveTheBytesOfTheCommandLine) {
  // Alone, above automatic colours, and above a picture.
  const json alone = {{"color", "nothing"}, {"strokes", kStrokes}};
  const std::string spread = FromStudio(alone);
  EXPECT_EQ(spread, FromCommandLine({"--hints", StrokesFile()}));
  const json above = {{"color", "automatic"}, {"strokes", kStrokes}};
  const std::string layered = FromStudio(above);
  EXPECT_EQ(layered, FromCommandLine({"--auto", "--hints", StrokesFile()}));
  const v1::KeyColorSource from_command =
      NewestJob("colorize_key_view").spec().colorize_key_view().source();
  EXPECT_NE(spread, layered);

  const fs::path truth = Path("room") / "truth" / kView;
  const std::string picture = ReadFile(truth);
  const json kept = json::parse(Post("/pictures?name=mine.png", picture));
  EXPECT_EQ(FromStudio({{"color", "picture"}, {"picture", kept["picture"]}, {"strokes", kStrokes}}),
            FromCommandLine({"--image", truth.string(), "--hints", StrokesFile()}));

  // A run gets the same source.
  json run = above;
  run.update({{"preset", "fast"}, {"key_view", kView}});
  const json job = json::parse(Post("/colorize", run.dump()));
  const v1::KeyColorSource from_studio =
      NewestJob("colorize_scene").spec().colorize_scene().key_color();
  EXPECT_EQ(from_studio.SerializeAsString(), from_command.SerializeAsString());
  EXPECT_TRUE(from_studio.automatic());
  EXPECT_TRUE(from_studio.backend_input().has_points());
  Client({"job", "cancel", "jobs/" + job["id"].get<std::string>()});
}

TEST_F(StudioStrokesTest, AreRefusedWithTheReason) {
  const auto refused = [&](json body) {
    body.update({{"photo", kView}, {"max_side", 100}});
    return Post("/preview", body.dump(), 400);
  };
  EXPECT_THAT(refused({{"color", "nothing"}}), HasSubstr("no strokes yet"));
  EXPECT_THAT(refused({{"color", "nothing"}, {"strokes", "{}"}}), HasSubstr("not a JSON list"));
  EXPECT_THAT(refused({{"color", "nothing"}, {"strokes", R"([{"x": 1}])"}}),
              HasSubstr("colour hint 0"));
  EXPECT_THAT(refused({{"color", "rainbow"}}), HasSubstr("color is automatic"));
  EXPECT_THAT(refused({{"color", "words"}}), HasSubstr("no words yet"));
  EXPECT_THAT(refused({{"color", "picture"}, {"picture", "../../set.json"}}),
              HasSubstr("the picture is missing"));
}

}  // namespace
}  // namespace color3d
