// Dynamic scenes through the service: films of cameras with poses, and pictures with times.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/scenes/dynamic_scene.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

class RigTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }

  // A film of each camera's pictures, with its first pose.
  void WriteFilms() {
    fs::create_directories(Path("rig"));
    WriteDynamicScene(Path("pictures"), made_);
    const json pictures = json::parse(ReadFile(Path("pictures") / "transforms.json"));
    json films = json::array();
    ThreadPool pool(1);
    for (int camera = 0; camera < made_.cameras(); ++camera) {
      const std::string name = "cam0" + std::to_string(camera);
      Mp4Writer writer(Path("rig") / (name + ".mp4"),
                       {.width = 128, .height = 96, .frames_per_second = 8});
      for (int time = 0; time < made_.times(); ++time) {
        writer.Add(made_.RenderSrgb(made_.ViewOf(camera, time)), pool);
      }
      writer.Finish();
      for (json frame : pictures["frames"]) {
        if (frame["camera"] != name || frame["time"] != 0.0) continue;
        frame["file_path"] = name + ".mp4";
        frame.erase("time");
        films.push_back(frame);
      }
    }
    WriteFileAtomic(Path("rig") / "transforms.json", json({{"frames", films}}).dump());
  }
  ProcessResult Colorize(const std::string& scene, const std::vector<std::string>& more) {
    return Client(
        std::vector<std::string>{"colorize", Path(scene).string(), "-o", Path("out").string()} +
        QuickOptions() + more);
  }

  const DynamicScene made_{{.which = DynamicCase::kSliding, .cameras = 3, .times = 9}};
};

TEST_F(RigTest, PosedFilmsBecomeADynamicScene) {
  WriteFilms();
  WriteFileAtomic(Path("painted.png"), EncodePng8(made_.RenderSrgb(made_.ViewOf(1, 3))));
  const ProcessResult result = Colorize("rig",
                                        {"--key-view",
                                         "cam01/f000003",
                                         "--key-color",
                                         Path("painted.png").string(),
                                         "--hold-out",
                                         "--png",
                                         "--set",
                                         "import_scene.hold_out_camera=cam02"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.err, HasSubstr("3 films of cameras with poses"));
  bool told = false;
  for (const json& step : json::parse(ReadFile(Path("out") / "plan.json"))) {
    if (step["step"] != "deformation_over_time") continue;
    EXPECT_THAT(step["reason"].get<std::string>(),
                HasSubstr("the views show 9 time steps, seen by 3 cameras; partly dynamic: "));
    told = step["needed"] && step.value("motion", "") == "partly dynamic" &&
           step.value("moving_share", 0.0) > 0.0;
  }
  EXPECT_TRUE(told) << ReadFile(Path("out") / "plan.json");
  const json metrics = json::parse(ReadFile(Path("out") / "metrics.json"));
  EXPECT_GT(metrics.at("gaussians"), 1000);
  EXPECT_EQ(metrics.at("motion"), "partly dynamic");
  EXPECT_GT(metrics.at("moving_share"), 0.0);
  EXPECT_TRUE(fs::exists(Path("out") / "scene.ply"));
  // The key view's camera: its coloured frames, and renders of the scene.
  EXPECT_THAT(result.out, HasSubstr("film.mp4"));
  for (const char* movie : {"film.mp4", "scene.mp4"}) {
    EXPECT_EQ(FilmReader(Path("out") / movie).times().size(), 9u) << movie;
  }
  // The frames of every camera, as a film and as pictures.
  EXPECT_THAT(result.out, HasSubstr("films/"));
  for (const std::string camera : {"cam00", "cam01", "cam02"}) {
    const FilmReader film(Path("out") / "films" / (camera + ".mp4"));
    EXPECT_EQ(film.times().size(), 9u) << camera;
    EXPECT_EQ(film.facts().width, 128) << camera;
    EXPECT_EQ(ReadImage(Path("out") / "film_frames" / camera / "f000008.png").width, 128);
  }
}

TEST_F(RigTest, ReportsFilmOptionsThatDoNotApply) {
  WriteFilms();
  const ProcessResult films = Colorize("rig", {"--deflicker"});
  EXPECT_EQ(films.exit_code, 0) << films.err;
  EXPECT_THAT(films.err, HasSubstr("film_deflicker is ignored: films with poses"));
  const ProcessResult pictures =
      Colorize("pictures", {"--set", "import_scene.film_frames_per_second=16"});
  EXPECT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_THAT(pictures.err,
              HasSubstr("film_frames_per_second is ignored: pictures with times and poses"));
}

TEST_F(RigTest, ScoresAreGroupedByHeldOutKind) {
  WriteFilms();  // also the pictures
  const ProcessResult result = Colorize("pictures",
                                        {"--benchmark",
                                         "--key-view",
                                         "cam01/0006",
                                         "--set",
                                         "import_scene.hold_out_camera=cam02",
                                         "--set",
                                         "import_scene.hold_out_block=0.25"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const json metrics = json::parse(ReadFile(Path("out") / "metrics.json"));
  EXPECT_EQ(metrics.at("views_camera"), 9);
  EXPECT_EQ(metrics.at("views_block"), 4);  // the fourth and the fifth moment of two cameras
  EXPECT_FALSE(metrics.contains("views_moment")) << "the eighth time step is in the block";
  const double all = metrics.at("delta_e00_chroma"), camera = metrics.at("delta_e00_chroma_camera"),
               block = metrics.at("delta_e00_chroma_block");
  EXPECT_NEAR(all, (9 * camera + 4 * block) / 13, 1e-6);
  EXPECT_THAT(result.out, HasSubstr("held-out cameras"));
  EXPECT_THAT(result.out, HasSubstr("held-out blocks of time"));
  EXPECT_THAT(ReadFile(Path("out") / "report.html"), HasSubstr("delta_e00_chroma_block"));
}

TEST_F(RigTest, NamesInputThatDoesNotFit) {
  WriteFilms();
  fs::remove(Path("rig/cam01.mp4"));
  const ProcessResult missing = Colorize("rig", {"--auto"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("transforms.json: frame 1: there is no film cam01.mp4"));
  json pictures = json::parse(ReadFile(Path("pictures") / "transforms.json"));
  pictures["frames"][4].erase("time");
  WriteFileAtomic(Path("pictures") / "transforms.json", pictures.dump());
  const ProcessResult timeless = Colorize("pictures", {"--auto"});
  EXPECT_EQ(timeless.exit_code, 2);
  EXPECT_THAT(timeless.err,
              HasSubstr("transforms.json: frame 4 (images/cam00/0004.png) has no time"));
}

}  // namespace
}  // namespace color3d
