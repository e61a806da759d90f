// A coloured scene as a movie, through the whole service.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/integration/service_fixture.h"
#include "tests/support/formats/movie_reader.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class MovieTest : public ServiceTest {
 protected:
  void SetUp() override {
    StartServer();
    WriteProceduralScene(Path("room"), SmallRoom(8));
    const ProcessResult colored =
        Client(std::vector<std::string>{"colorize", Path("room").string(), "-o", Out(), "--auto"} +
               QuickOptions());
    ASSERT_EQ(colored.exit_code, 0) << colored.out << colored.err;
  }
  std::string Out() const { return Path("out").string(); }
  void ExpectBadInput();
};

TEST_F(MovieTest, RendersPathsOfResultsJobsAndScenes) {
  const ProcessResult turned = Client({"turntable", Out(), "--seconds", "1", "--fps", "12"});
  ASSERT_EQ(turned.exit_code, 0) << turned.err;
  EXPECT_NE(turned.out.find("turntable.mp4"), std::string::npos) << turned.out;
  EXPECT_NE(turned.err.find("render"), std::string::npos) << "no progress: " << turned.err;
  const ReadMovie movie = DecodeMovie(Path("out") / "turntable.mp4");
  EXPECT_EQ(movie.codec, "h264");
  EXPECT_EQ(movie.frames.size(), 12u);
  EXPECT_NEAR(movie.seconds, 1.0, 0.1);
  EXPECT_EQ(movie.width, 240);
  for (const Image& frame : movie.frames) {
    double mean = 0.0;
    for (const float value : frame.data) mean += value / static_cast<double>(frame.data.size());
    EXPECT_GT(mean, 0.15) << "the frame is empty";
  }

  const v1::Job job = NewestJob("colorize_scene");
  const std::string file = Path("sub/original.mp4").string();
  const ProcessResult original = Client({"render",
                                         job.name(),
                                         "--path",
                                         "original",
                                         "-o",
                                         file,
                                         "--seconds",
                                         "0.5",
                                         "--max-side",
                                         "101",
                                         "--json"});
  ASSERT_EQ(original.exit_code, 0) << original.err;
  EXPECT_EQ(json::parse(original.out).at("files").at(0), file);
  EXPECT_EQ(DecodeMovie(file).width, 100) << "even";
  EXPECT_EQ(DecodeMovie(file).frames.size(), 15u);

  WriteFileAtomic(Path("cameras.json"),
                  R"({"w": 64, "h": 48, "camera_angle_x": 1.2, "frames": [
                      {"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]},
                      {"transform_matrix": [[1,0,0,0.1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})");
  const ProcessResult by_file = Client({"render",
                                        job.spec().scene(),
                                        "--path",
                                        Path("cameras.json").string(),
                                        "-o",
                                        Path("frames").string(),
                                        "--png"});
  ASSERT_EQ(by_file.exit_code, 0) << by_file.err;
  EXPECT_TRUE(fs::is_regular_file(Path("frames") / "frames/00002.png"));
  EXPECT_EQ(DecodeMovie(Path("frames") / "scene.mp4").frames.size(), 2u);

  const ProcessResult pictures =
      Client({"render", Out(), "--views", "view001", "-o", Path("pictures").string()});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_EQ(ListFiles(Path("pictures")).size(), 1u);
  ExpectBadInput();
}

// Wrong input gives one line, exit code 2 and no file.
void MovieTest::ExpectBadInput() {
  const std::string file = Path("bad.mp4").string();
  ExpectRefusal(Client({"turntable", Path("nowhere").string()}), 2, {"there is no folder"});
  EXPECT_FALSE(fs::exists(Path("nowhere")));
  ExpectRefusal(Client({"turntable", Path("room").string(), "-o", file}), 2, {"model.c3g"});
  ExpectRefusal(Client({"turntable", Out(), "-o", file, "--seconds", "900"}),
                2,
                {"frames is 27000", "18000"});
  ExpectRefusal(Client({"render", Out(), "-o", file}), 2, {"--path"});
  ExpectRefusal(Client({"render", Out(), "-o", file, "--path", Path("no.json").string()}),
                2,
                {"there is no file", "orbit"});
  WriteFileAtomic(Path("broken.json"), "{\"frames\": [{]");
  ExpectRefusal(Client({"render", Out(), "-o", file, "--path", Path("broken.json").string()}),
                2,
                {"not JSON"});
  ExpectRefusal(Client({"render", Out(), "-o", file, "--path", "orbit", "--views", "view001"}),
                2,
                {"--views"});
  ExpectRefusal(Client({"render", NewestJob("select_key_view").name(), "--path", "orbit"}),
                2,
                {"select_key_view", "model.c3g"});
  EXPECT_FALSE(fs::exists(file));
  fs::create_directories(Path("other"));
  WriteFileAtomic(Path("other/model.c3g"), "another");
  ExpectRefusal(Client({"turntable", Path("other").string()}), 2, {"no job of the server"});
}

}  // namespace
}  // namespace color3d
