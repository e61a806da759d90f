// view.html of a real film whose Gaussians move, in headless Chromium against our own renderer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "core/image/codec.h"
#include "core/metrics/quality.h"
#include "tests/integration/studio_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::IsEmpty;

constexpr int kStopsOfFrame = 10;                  // of the slider, core/view/page/player.js
constexpr double kMaxBytesOfFrame = 25e6 / 100.0;  // of the page
constexpr size_t kMoments = 4;

// The server, Chromium and Node.
class FilmPageTest : public StudioTest {};

TEST_F(FilmPageTest, PlaysAsOurRendererDraws) {
  const fs::path film = fs::path(COLOR3D_SHARED_DATA) / "video/lady_running";
  if (!fs::is_directory(film)) GTEST_SKIP() << "skipped, because there is no " << film;
  const fs::path out = Path("out");
  const ProcessResult colored = Client(
      {"colorize", film, "-o", out, "--film", "--poses", "--auto", "--seed", "1"}, seconds(1500));
  ASSERT_EQ(colored.exit_code, 0) << colored.err;
  const auto frames = std::distance(fs::directory_iterator(film), {});
  EXPECT_LT(fs::file_size(out / "view.html"), kMaxBytesOfFrame * static_cast<double>(frames));

  // Frames as our renderer draws them, named like the photos: 00000, 00001, ...
  std::vector<fs::path> drawn(fs::directory_iterator(out / "renders"), {});
  ASSERT_GE(drawn.size(), kMoments);
  std::ranges::sort(drawn);
  std::vector<fs::path> moments;
  std::vector<std::string> stops = {"film"};
  for (size_t i = 0; i < kMoments; ++i) {
    moments.push_back(drawn[(2 * i + 1) * drawn.size() / (2 * kMoments)]);
    stops.push_back(std::to_string(kStopsOfFrame * std::stoi(moments.back().stem())));
  }
  const auto render = [](const fs::path& file) { return DecodeImage(ReadFile(file), file); };
  const Image first = render(moments[0]);
  const fs::path pictures = Path("pictures");
  const ProcessResult played = RunProcess(std::vector<std::string>{"node",
                                                                   COLOR3D_PLAY_PAGE,
                                                                   "chromium",
                                                                   out / "view.html",
                                                                   pictures,
                                                                   std::to_string(first.width),
                                                                   std::to_string(first.height)} +
                                              stops,
                                          Path("played"),
                                          seconds(400));
  ASSERT_EQ(played.exit_code, 0) << played.err;
  const auto seen = nlohmann::json::parse(played.out);
  SCOPED_TRACE(seen.dump(1));
  EXPECT_EQ(seen.at("state"), "ready");
  EXPECT_THAT(seen.at("errors"), IsEmpty());
  EXPECT_THAT(seen.at("requests"), IsEmpty());
  EXPECT_GE(seen.at("loops"), 8);  // after two before the memory is looked at
  const double before = seen.at("heap").at(0), after = seen.at("heap").at(1);
  EXPECT_LT(after, 1.05 * before + 500'000);
  for (size_t i = 0; i < kMoments; ++i) {
    const Image page = render(pictures / (stops[i + 1] + ".png"));
    const double psnr_db = Psnr(page, render(moments[i]), 1.0);
    RecordProperty("psnr_db_" + stops[i + 1], std::to_string(psnr_db));
    EXPECT_GE(psnr_db, 30.0) << moments[i];
  }
}

}  // namespace
}  // namespace color3d
