// Photos in, coloured scene out: the whole service, end to end.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/digest.h"
#include "core/image/codec.h"
#include "core/view/view_page.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/scenes/noise_place.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;

class ColorizeTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }
  void ExpectSameBytesFromArtifactDownload(const std::string& job);
  void ExpectPageToLookAt(const v1::Job& job);
};

// `artifact download` returns the bytes that the job uploaded.
void ColorizeTest::ExpectSameBytesFromArtifactDownload(const std::string& job) {
  const ProcessResult result =
      Client({"artifact", "download", job, "-o", Path("artifacts").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  int files = 0;
  const v1::Job done = NewestJob("colorize_scene");
  for (const v1::Artifact& artifact : done.artifacts()) {
    const fs::path file = Path("artifacts") / artifact.name();
    ASSERT_TRUE(fs::is_regular_file(file)) << artifact.name();
    EXPECT_EQ(DigestFile(file).sha256, artifact.digest().sha256()) << artifact.name();
    ++files;
  }
  EXPECT_GE(files, 6);
}

// `view` downloads the page of a job and of its scene, and finds it in a folder of results.
void ColorizeTest::ExpectPageToLookAt(const v1::Job& job) {
  const std::string out = Path("page").string();
  const ProcessResult of_job = Client({"view", job.name(), "-o", out, "--no-open", "--json"});
  if (!HasViewer()) {
    ExpectRefusal(of_job, 2, {"view.html", "npm"});
    return;
  }
  ASSERT_EQ(of_job.exit_code, 0) << of_job.err;
  const std::string page = json::parse(of_job.out).at("page");
  EXPECT_EQ(fs::path(page), fs::absolute(Path("page") / "view.html"));
  EXPECT_NE(ReadFile(page).find("\"scene\":\"scene."), std::string::npos);
  fs::remove_all(out);
  const ProcessResult of_scene = Client({"view", job.spec().scene(), "-o", out, "--no-open"});
  ASSERT_EQ(of_scene.exit_code, 0) << of_scene.err;
  EXPECT_NE(of_scene.out.find(page), std::string::npos) << of_scene.out;
  EXPECT_EQ(Client({"view", out, "--no-open"}).exit_code, 0);
  fs::remove_all(out);
  fs::create_directories(out);
  ExpectRefusal(Client({"view", out}), 2, {out, "view.html", "artifact download"});
  ExpectRefusal(Client({"view", Path("nowhere").string()}), 2, {"there is no folder"});
}

// Prints of different things, and of different shapes: there is no scene to reconstruct.
TEST_F(ColorizeTest, PhotosWithoutASceneAreColoredOneByOne) {
  const fs::path prints = Path("prints"), out = Path("out");
  fs::create_directories(prints);
  const std::pair<int, int> sizes[] = {{320, 240}, {240, 320}, {300, 300}};
  for (int i = 0; i < 3; ++i) {
    WriteFileAtomic(prints / ("print" + std::to_string(i) + ".png"),
                    EncodePng8(NoisePlace(i + 1, sizes[i].first, sizes[i].second, 0)));
  }
  const ProcessResult result =
      Client({"colorize", prints, "-o", out, "--auto", "--seed", "1"}, seconds(300));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("coloured as pictures, without a 3D scene"), std::string::npos)
      << result.err;
  EXPECT_NE(result.out.find("coloured photos"), std::string::npos) << result.out;
  for (int i = 0; i < 3; ++i) {
    const Image photo = ReadImage(out / "photos" / ("print" + std::to_string(i) + ".png"));
    EXPECT_EQ(photo.channels, 3);
    EXPECT_EQ(photo.width, sizes[i].first);
    EXPECT_EQ(photo.height, sizes[i].second);
  }
  EXPECT_FALSE(fs::exists(out / "view.html"));
  EXPECT_TRUE(fs::exists(out / "report.html"));
}

TEST_F(ColorizeTest, ReadOnlyCommandsPrintTextAndJson) {
  WriteProceduralScene(Path("room"), SmallRoom(3));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"server", "info"},
        std::vector<std::string>{"server", "presets"},
        std::vector<std::string>{"server", "presets", "paper"},
        std::vector<std::string>{"job", "list"},
        std::vector<std::string>{"scene", "list"},
        std::vector<std::string>{"inspect", Path("room").string()}}) {
    const ProcessResult words = Client(command);
    EXPECT_EQ(words.exit_code, 0) << command[0] << words.err;
    EXPECT_FALSE(words.out.empty());
    const ProcessResult program = Client(command + std::vector<std::string>{"--json"});
    EXPECT_EQ(program.exit_code, 0) << command[0] << program.err;
    EXPECT_TRUE(json::accept(program.out)) << program.out;
  }
  EXPECT_EQ(Client({"job", "show", "jobs/0000"}).exit_code, 2);
  EXPECT_EQ(Client({"server", "presets", "heroic"}).exit_code, 2);
}

void ExpectResults(const fs::path& out, int min_renders) {
  for (const char* name :
       {"scene.ply", "metrics.json", "curves.csv", "plan.json", "report.html", "key_view.png"}) {
    ASSERT_TRUE(fs::is_regular_file(out / name)) << name;
    EXPECT_GT(fs::file_size(out / name), 20u) << name;
  }
  int renders = 0;
  for (const std::string& name : ListFiles(out / "renders")) {
    const Image render = ReadImage(out / "renders" / name);
    EXPECT_EQ(render.channels, 3);
    EXPECT_FALSE(IsGray(render)) << name << " has no colour";
    ++renders;
  }
  EXPECT_GE(renders, min_renders);
  EXPECT_NE(ReadFile(out / "report.html").find("</html>"), std::string::npos);
  EXPECT_TRUE(json::parse(ReadFile(out / "plan.json")).is_structured());
}

void ExpectMetrics(const json& metrics) {
  std::set<std::string> names{"psnr_rgb",
                              "ssim_rgb",
                              "psnr_l",
                              "ab_rmse",
                              "delta_e00",
                              "delta_e00_chroma",
                              "delta_e00_chroma_2d",
                              "delta_e00_gray",
                              "colorfulness",
                              "colorfulness_truth",
                              "gaussians",
                              "seconds_total"};
  for (const char* stage : {"import_scene",
                            "select_key_view",
                            "colorize_key_view",
                            "personalize",
                            "colorize_views",
                            "reconstruct_geometry",
                            "solve_chroma",
                            "export",
                            "render",
                            "evaluate"}) {
    names.insert(std::string("seconds_") + stage);
  }
  for (const std::string& name : names) {
    ASSERT_TRUE(metrics.contains(name)) << name;
    ASSERT_TRUE(metrics[name].is_number()) << name;
    EXPECT_TRUE(std::isfinite(metrics[name].get<double>())) << name;
  }
  // Far below the result of a full schedule, far above that of an error.
  EXPECT_GT(metrics["psnr_l"].get<double>(), 17.0);
  EXPECT_LT(metrics["delta_e00_chroma_2d"].get<double>(), metrics["delta_e00_gray"].get<double>());
  EXPECT_LT(metrics["delta_e00_chroma"].get<double>(), metrics["delta_e00_gray"].get<double>());
  EXPECT_GT(metrics["gaussians"].get<double>(), 500.0);
  EXPECT_GT(metrics["colorfulness"].get<double>(), 5.0);
}

std::string KeyView(const fs::path& out) {
  return json::parse(ReadFile(out / "key_view.json")).at("view");
}

int CountCached(const std::vector<v1::Job>& jobs) {
  int cached = 0;
  for (const v1::Job& job : jobs) cached += job.cached() ? 1 : 0;
  return cached;
}

TEST_F(ColorizeTest, BenchmarkIsScoredThenServedFromTheCache) {
  WriteProceduralScene(Path("room"), SmallRoom());
  const auto command = [&](const std::string& out) {
    return std::vector<std::string>{"colorize",
                                    Path("room").string(),
                                    "-o",
                                    Path(out).string(),
                                    "--benchmark",
                                    "--bound"} +
           QuickOptions();
  };
  const ProcessResult first = Client(command("first"));
  ASSERT_EQ(first.exit_code, 0) << first.out << first.err;
  ExpectResults(Path("first"), 2);
  const json metrics = json::parse(ReadFile(Path("first") / "metrics.json"));
  ExpectMetrics(metrics);
  EXPECT_LT(metrics.at("delta_e00_chroma_bound"), metrics.at("delta_e00_gray"));
  for (const char* name : {"me", "me_2d", "me_truth", "tc", "tc_2d", "tc_truth"}) {
    EXPECT_GT(metrics.value(name, 0.0), 0.0) << name;
  }
  const std::string curves = ReadFile(Path("first") / "curves.csv");
  for (const char* stage : {"personalize", "reconstruct_geometry", "solve_chroma"}) {
    EXPECT_NE(curves.find(stage), std::string::npos) << stage << " left no curve";
  }
  for (const v1::Job& job : server().ListJobs()) {
    if (job.kind() == "generate_augmentations" || job.kind() == "correct_colors") {
      EXPECT_EQ(job.state(), v1::Job::STATE_SKIPPED) << job.kind();
      continue;
    }
    EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.kind();
    EXPECT_EQ(job.attempt(), 1) << job.kind();
  }
  // Except the import, which ran for the selection of the key view.
  ASSERT_LE(CountCached(server().ListJobs()), 1);

  const ProcessResult second = Client(command("second"));
  ASSERT_EQ(second.exit_code, 0) << second.out << second.err;
  ExpectResults(Path("second"), 2);
  EXPECT_GE(CountCached(server().ListJobs()), 9);
  EXPECT_LT(second.seconds, 0.5 * first.seconds + 3.0);
  EXPECT_EQ(ReadFile(Path("second") / "scene.ply"), ReadFile(Path("first") / "scene.ply"));
}

TEST_F(ColorizeTest, ColorsMonochromePhotosFromAPaintedKeyView) {
  WriteProceduralScene(Path("room"), SmallRoom(8, /*gray=*/true));
  const std::string room = Path("room").string(), out = Path("out").string();
  const ProcessResult select = Client({"colorize", room, "-o", out});
  ASSERT_EQ(select.exit_code, 0) << select.err;
  EXPECT_NE(select.out.find("--key-color"), std::string::npos) << "the next command is not printed";
  const Image key = ReadImage(Path("out") / "key_view.png");
  EXPECT_EQ(key.width, 240);
  EXPECT_TRUE(IsGray(key));
  EXPECT_FALSE(fs::exists(Path("out") / "scene.ply"));

  const std::string name = KeyView(Path("out"));
  EXPECT_EQ(ReadImage(Path("room") / "images" / name).data, key.data);

  // The view does not follow from the name of the coloured file: OUT records it.
  fs::copy_file(Path("room") / "truth" / name, Path("painted.png"));
  const ProcessResult color =
      Client(std::vector<std::string>{
                 "colorize", room, "-o", out, "--key-color", Path("painted.png").string()} +
             QuickOptions());
  ASSERT_EQ(color.exit_code, 0) << color.out << color.err;
  ExpectResults(Path("out"), 2);
  const json metrics = json::parse(ReadFile(Path("out") / "metrics.json"));
  EXPECT_FALSE(metrics.contains("psnr_rgb")) << "there was no truth to score against";
  EXPECT_GT(metrics.value("me", 0.0), 0.0) << "views can be compared without truth";
  EXPECT_GT(metrics.at("gaussians").get<int>(), 500);
  EXPECT_EQ(KeyView(Path("out")), name);
}

TEST_F(ColorizeTest, ColorsTheKeyViewByJsonHints) {
  WriteProceduralScene(Path("room"), SmallRoom(6, /*gray=*/true));
  WriteFileAtomic(Path("hints.json"),
                  R"([{"x": 60, "y": 30, "radius": 4, "color": "#2f6f7f"},
                      {"x": 120, "y": 150, "radius": 4, "color": "#203070"},
                      {"x": 200, "y": 90, "radius": 4, "color": "#903020"}])");
  Process client(ClientCommand(std::vector<std::string>{"colorize",
                                                        Path("room").string(),
                                                        "-o",
                                                        Path("out").string(),
                                                        "--key-view",
                                                        "view003",
                                                        "--hints",
                                                        Path("hints.json").string()} +
                               QuickOptions()),
                 Path("client"));
  v1::Job colored;
  ASSERT_TRUE(WaitUntil(
      [&] {
        for (const v1::Job& job : server().ListJobs()) {
          if (job.kind() == "colorize_key_view") colored = job;
        }
        return colored.state() >= v1::Job::STATE_SUCCEEDED || !client.IsRunning();
      },
      seconds(120)))
      << client.Err();
  EXPECT_EQ(colored.state(), v1::Job::STATE_SUCCEEDED) << colored.error().message() << client.Err();
  EXPECT_EQ(NewestJob("select_key_view").spec().select_key_view().view(), "view003");
  client.Kill();  // the job continues without its client
  EXPECT_TRUE(server().IsHealthy());
  const ProcessResult cancel = Client({"job", "cancel", NewestJob("colorize_scene").name()});
  EXPECT_EQ(cancel.exit_code, 0) << cancel.err;
  EXPECT_TRUE(
      WaitUntil([&] { return NewestJob("colorize_scene").state() == v1::Job::STATE_CANCELLED; },
                seconds(60)));
}

// Schedules of hours, cut to seconds: the result must still be complete.
TEST_F(ColorizeTest, TimeBudgetShortensTheSchedules) {
  WriteProceduralScene(Path("room"), SmallRoom(6));
  const ProcessResult result = Client({"colorize",
                                       Path("room").string(),
                                       "-o",
                                       Path("out").string(),
                                       "--benchmark",
                                       "--max-side",
                                       "240",
                                       "--geometry-iterations",
                                       "100000",
                                       "--colorizer-iterations",
                                       "100000",
                                       "--time-budget",
                                       "40s"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  ExpectResults(Path("out"), 1);
  const double limit =
      NewestJob("reconstruct_geometry").spec().reconstruct_geometry().time_limit_seconds();
  EXPECT_GT(limit, 1.0);
  EXPECT_LT(limit, 40.0);
  const json metrics = json::parse(ReadFile(Path("out") / "metrics.json"));
  EXPECT_GT(metrics["psnr_l"].get<double>(), 17.0);
}

TEST_F(ColorizeTest, DetachReturnsAtOnceAndWatchReattaches) {
  WriteProceduralScene(Path("room"), SmallRoom(6));
  const ProcessResult detached = Client(std::vector<std::string>{"colorize",
                                                                 Path("room").string(),
                                                                 "-o",
                                                                 Path("out").string(),
                                                                 "--benchmark",
                                                                 "--detach"} +
                                        QuickOptions());
  ASSERT_EQ(detached.exit_code, 0) << detached.err;
  const std::string job = NewestJob("colorize_scene").name();
  ExpectRefusal(
      Client({"view", NewestJob("colorize_scene").spec().scene()}), 2, {"still being", job});
  EXPECT_NE(detached.out.find(job.substr(job.find('/') + 1)), std::string::npos) << detached.out;
  const ProcessResult watched = Client({"job", "watch", job});
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
  const ProcessResult shown = Client({"job", "show", job, "--json"});
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_NE(shown.out.find("SUCCEEDED"), std::string::npos);
  EXPECT_TRUE(json::accept(shown.out)) << shown.out;
  ExpectSameBytesFromArtifactDownload(job);
  ExpectPageToLookAt(NewestJob("colorize_scene"));
}

}  // namespace
}  // namespace color3d
