// `color3d correct`: strokes, saturation and undo on a coloured scene, through the whole service.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr char kView[] = "view002.png";

class CorrectTest : public ServiceTest {
 protected:
  void SetUp() override {
    StartServer();
    WriteProceduralScene(Path("room"), SmallRoom(6, /*gray=*/true));
    const ProcessResult colored =
        Client(std::vector<std::string>{"colorize",
                                        Path("room").string(),
                                        "-o",
                                        Out(),
                                        "--key-view",
                                        "view001.png",
                                        "--key-color",
                                        (Path("room") / "truth" / "view001.png").string()} +
               QuickOptions());
    ASSERT_EQ(colored.exit_code, 0) << colored.out << colored.err;
  }
  std::string Out() const { return Path("out").string(); }
  json Correct(const std::vector<std::string>& arguments) {
    const ProcessResult result =
        Client(std::vector<std::string>{"correct", Out(), "--json"} + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    return json::parse(result.out, nullptr, /*allow_exceptions=*/false);
  }
  // The stages that ran, i.e. were not in the cache.
  std::set<std::string> Done(const json& answer) {
    std::set<std::string> kinds;
    for (const v1::Job& job : server().ListJobs()) {
      if (job.parent() != answer.at("job") || job.cached()) continue;
      if (job.state() == v1::Job::STATE_SUCCEEDED) kinds.insert(job.kind());
    }
    return kinds;
  }
  void ExpectRefused(const std::vector<std::string>& arguments, const std::string& why) {
    const ProcessResult result = Client(std::vector<std::string>{"correct", Out()} + arguments);
    EXPECT_NE(result.exit_code, 0) << why;
    EXPECT_THAT(result.err, HasSubstr(why));
  }
  // Mean a of a render around a position, in 0..1 of the picture.
  double RednessAt(const std::string& view, double x, double y) const {
    const Image lab = LabFromSrgb(ReadImage(Path("out") / "renders" / view));
    double sum = 0.0;
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) {
        sum += lab.At(1,
                      static_cast<int>(y * (lab.height - 1)) + dy,
                      static_cast<int>(x * (lab.width - 1)) + dx);
      }
    }
    return sum / 25.0;
  }
};

TEST_F(CorrectTest, ProposesPlacesAppliesAStrokeAndUndoesIt) {
  const std::string before = ReadFile(Path("out") / "model.c3g");
  const json proposed = Correct({});
  ASSERT_FALSE(proposed.at("proposals").empty());
  const std::string proposed_view = proposed.at("proposals").at(0).at("view");
  const Image to_paint = ReadImage(Path("out") / "paint" / proposed_view);
  const Image photo = ReadImage(Path("room") / "images" / proposed_view);
  EXPECT_EQ(to_paint.width, photo.width);
  EXPECT_EQ(to_paint.height, photo.height);
  EXPECT_EQ(ReadFile(Path("out") / "model.c3g"), before) << "proposals changed the model";
  EXPECT_EQ(Done(proposed), std::set<std::string>{"correct_colors"});

  // The user's paint is not overwritten.
  Image painted = to_paint;
  for (int i = 0; i < 40 * 40; ++i) painted.At(0, 20 + i / 40, 20 + i % 40) = 0.9f;
  const std::string mine = EncodePng8(painted);
  WriteFileAtomic(Path("out") / "paint" / proposed_view, mine);

  const double x = 0.5, y = 0.6;
  const double was = RednessAt(kView, x, y);
  const auto at = fmt::format("{},{}", x * photo.width, y * photo.height);
  const json corrected =
      Correct({"--view", "view002", "--at", at, "--color", "#ff2020", "--radius", "14"});
  EXPECT_EQ(corrected.at("corrections"), 1);
  EXPECT_GT(RednessAt(kView, x, y), was + 15.0);
  EXPECT_EQ(
      Done(corrected),
      (std::set<std::string>{"correct_colors", "solve_chroma", "export", "render", "evaluate"}));

  const std::string stem = fs::path(proposed_view).stem().string();
  EXPECT_EQ(ReadFile(Path("out") / "paint" / (stem + ".painted.png")), mine);
  const json repainted = Correct({"--view",
                                  proposed_view,
                                  "--image",
                                  (Path("out") / "paint" / (stem + ".painted.png")).string()});
  EXPECT_EQ(repainted.at("corrections"), 2);
  Correct({"--undo", "1"});

  const json undone = Correct({"--undo", "1"});
  EXPECT_EQ(undone.at("corrections"), 0);
  EXPECT_EQ(ReadFile(Path("out") / "model.c3g"), before);
  ExpectRefused({"--undo", "1"}, "this scene has 0 corrections");
}

TEST_F(CorrectTest, ChangesSaturationAndWhiteBalance) {
  Correct({"--saturation", "0"});
  const Image gray = LabFromSrgb(ReadImage(Path("out") / "renders" / kView));
  double chroma = 0.0;
  for (int c = 1; c < 3; ++c) {
    for (size_t i = 0; i < gray.PlaneSize(); ++i) chroma += std::abs(gray.Plane(c)[i]);
  }
  EXPECT_LT(chroma / static_cast<double>(gray.PlaneSize()), 0.5);
  const double neutral = RednessAt(kView, 0.5, 0.6);
  const json tinted = Correct({"--tint", "20"});
  EXPECT_GT(RednessAt(kView, 0.5, 0.6), neutral + 5.0) << "saturation was lost";
  ExpectRefused({"--saturation", "9"}, "saturation");
}

TEST_F(CorrectTest, RefusesBadInputWithARemedy) {
  ExpectRefused({"--view", "nobody", "--at", "5,5", "--color", "#ff0000"}, "nobody");
  ExpectRefused({"--view", "view002", "--at", "5000,5", "--color", "#ff0000"}, "outside");
  ExpectRefused({"--view", "view002", "--at", "5;5", "--color", "#ff0000"}, "give X,Y");
  ExpectRefused({"--view", "view002", "--at", "5,5"}, "--color");
  ExpectRefused({"--view", "view002"}, "needs a correction");
  ExpectRefused({"--at", "5,5", "--color", "#ff0000"}, "--view is missing");
  ExpectRefused({"--undo", "some"}, "give a number, or all");
  // A picture without paint.
  ExpectRefused(
      {"--view", "view001", "--image", (Path("room") / "images" / "view001.png").string()},
      "colour");
  const fs::path small = Path("small.png");
  WriteFileAtomic(small, EncodePng8(Image(20, 10, 3, 0.5f)));
  ExpectRefused({"--view", "view002", "--image", small.string()}, "20x10");
  EXPECT_TRUE(fs::is_regular_file(Path("out") / "model.c3g"));
}

}  // namespace
}  // namespace color3d
