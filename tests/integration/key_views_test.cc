// Several key views, through the whole service.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

using nlohmann::json;

class KeyViewsTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }

  std::string Truth(const std::string& photo) const {
    return (Path("room") / "truth" / photo).string();
  }
  json Result(const std::string& out, const std::string& name) const {
    return json::parse(ReadFile(Path(out) / name));
  }
};

// Larger than the colorizer's pictures, so that carried colours and their confidences, which are 1
// in the additional key views, are reduced (334 px to 267, where the mean of ones rounds to above
// 1).
TEST_F(KeyViewsTest, ColorsThreeKeyViewsOnceAndReportsThem) {
  ProceduralSceneOptions room = SmallRoom(6, /*gray=*/true);
  room.width = 500;
  room.height = 334;
  WriteProceduralScene(Path("room"), room);
  const std::vector<std::string> command = {"colorize",
                                            Path("room").string(),
                                            "-o",
                                            Path("out").string(),
                                            "--key-color",
                                            Truth("view002.png"),
                                            "--add-key-view",
                                            "view000.png=" + Truth("view000.png"),
                                            "--add-key-view",
                                            "view005=" + Truth("view005.png"),
                                            "--max-side",
                                            "500",
                                            "--max-gaussians",
                                            "15000",
                                            "--geometry-iterations",
                                            "150",
                                            "--colorizer-iterations",
                                            "10",
                                            "--chroma-iterations",
                                            "10"};
  const ProcessResult result = Client(command);
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(NewestJob("carry_color").spec().carry_color().further_key_views_size(), 2);
  const std::string report = ReadFile(Path("out") / "report.html");
  size_t chapters = 0;
  for (size_t at = 0; (at = report.find("<h2>Additional key view", at)) != std::string::npos;
       ++at) {
    ++chapters;
  }
  EXPECT_EQ(chapters, 2u);
  EXPECT_EQ(Result("out", "key_views/1/key_color.json").at("view"), "view000.png");
  EXPECT_EQ(Result("out", "key_views/2/key_color.json").at("view"), "view005.png");
  EXPECT_FALSE(IsGray(ReadImage(Path("out") / "key_views/2/key_view_colored.png")));
  EXPECT_EQ(Result("out", "metrics.json").at("key_views"),
            json({"view002.png", "view000.png", "view005.png"}));

  const auto key_views = [&] {
    std::vector<v1::Job> jobs;
    for (const v1::Job& job : server().ListJobs()) {
      if (job.kind() == "colorize_key_view") jobs.push_back(job);
    }
    return jobs;
  };
  ASSERT_EQ(key_views().size(), 3u);
  const ProcessResult again =
      Client(command + std::vector<std::string>{"--set", "solve_chroma.saturation=1.2"});
  ASSERT_EQ(again.exit_code, 0) << again.out << again.err;
  const auto both = key_views();
  ASSERT_EQ(both.size(), 6u);
  EXPECT_EQ(
      std::count_if(both.begin(), both.end(), [](const v1::Job& job) { return job.cached(); }), 3);
  EXPECT_TRUE(NewestJob("carry_color").cached());
}

TEST_F(KeyViewsTest, BenchmarkChoosesSeveralForOneGeometry) {
  WriteProceduralScene(Path("room"), SmallRoom(8));
  const auto benchmark = [&](const std::string& out, const std::vector<std::string>& more) {
    return Client(std::vector<std::string>{
                      "colorize", Path("room").string(), "-o", Path(out).string(), "--benchmark"} +
                  more + QuickOptions());
  };
  const ProcessResult result = benchmark("out", {"--keys", "3", "--key-view", "view004"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const json metrics = Result("out", "metrics.json");
  ASSERT_EQ(metrics.at("key_views").size(), 3u);
  EXPECT_EQ(metrics.at("key_views")[0], "view004.png");
  int made = 0;
  for (const v1::Job& job : server().ListJobs()) {
    made += job.kind() == "reconstruct_geometry" && !job.cached() ? 1 : 0;
  }
  EXPECT_EQ(made, 1);
  ExpectRefusal(benchmark("many", {"--keys", "8"}), 2, {"8 key views", "7 training views"});
  ExpectRefusal(benchmark("both", {"--keys", "2", "--auto"}), 2, {"--keys", "true colours"});
  ExpectRefusal(benchmark("more", {"--keys", "2", "--add-key-view", "view001=auto"}),
                2,
                {"leave out --add-key-view"});
  ExpectRefusal(benchmark("none", {"--add-key-view", "view099=auto"}), 2, {"view099"});
  ExpectRefusal(benchmark("same", {"--key-view", "view004", "--add-key-view", "view004.png=auto"}),
                2,
                {"already"});
  ExpectRefusal(benchmark("held", {"--key-view", "view000"}), 2, {"view000", "held out"});
  ExpectRefusal(benchmark("held2", {"--key-view", "view004", "--add-key-view", "view000=auto"}),
                2,
                {"view000", "held out"});

  const ProcessResult select = Client({"key",
                                       "select",
                                       Path("room").string(),
                                       "-o",
                                       Path("key").string(),
                                       "--count",
                                       "2",
                                       "--json"});
  ASSERT_EQ(select.exit_code, 0) << select.err;
  EXPECT_EQ(json::parse(select.out).at("key_views").size(), 2u);
}

// The photo as the client sends it in a benchmark: L in 16 bits.
std::vector<float> GrayLevels(const Image& srgb) {
  std::vector<float> levels;
  for (const float l : LuminanceFromSrgb(srgb).data) {
    levels.push_back(std::round(static_cast<float>(GrayFromLuminance(l)) * 65535.0f));
  }
  return levels;
}

// Returns a pixel of 16 bits with random chroma and grey level `level`, or nullopt if none is
// found.
std::optional<std::array<float, 3>> RandomColor(float luminance, float level, Random* random) {
  const auto gray = [](const Image& pixel) {
    return static_cast<float>(GrayFromLuminance(LuminanceFromSrgb(pixel).data[0])) * 65535.0f;
  };
  for (int attempt = 0; attempt < 30; ++attempt) {
    Image lab(1, 1, 3);
    lab.data = {luminance,
                static_cast<float>(random->NextUniform(-50, 50)),
                static_cast<float>(random->NextUniform(-50, 50))};
    Image pixel = SrgbFromLab(lab);
    for (float& value : pixel.data) value = std::round(value * 65535.0f) / 65535.0f;
    // The largest green, then blue, with a tenth of its weight, below the level.
    for (const int channel : {1, 2}) {
      int low = 0, high = 65535;
      while (low < high) {
        const int middle = (low + high + 1) / 2;
        pixel.data[channel] = static_cast<float>(middle) / 65535.0f;
        if (gray(pixel) <= level + 0.1f) {
          low = middle;
        } else {
          high = middle - 1;
        }
      }
      pixel.data[channel] = static_cast<float>(low) / 65535.0f;
    }
    // Inside the interval that is rounded to the level.
    if (std::abs(gray(pixel) - level) < 0.3f) {
      return std::array<float, 3>{pixel.data[0], pixel.data[1], pixel.data[2]};
    }
  }
  return std::nullopt;
}

// Random chroma in every pixel of a photo, with an equal grey copy.
Image Repainted(const Image& photo, uint64_t seed) {
  const std::vector<float> levels = GrayLevels(photo);
  const Image luminance = LuminanceFromSrgb(photo);
  Image out = photo;
  std::vector<char> wrong(levels.size(), 1);
  // Rounding depends on the position of a pixel in its picture, so the result is checked.
  for (uint64_t pass = 0; pass < 8; ++pass) {
    ThreadPool pool(2);
    pool.ForEach(photo.height, [&](int64_t y, int) {
      Random random(seed + 1000 * pass, static_cast<uint64_t>(y));
      for (int x = 0; x < photo.width; ++x) {
        const size_t i = static_cast<size_t>(y) * photo.width + x;
        if (wrong[i] == 0) continue;
        const auto color = RandomColor(luminance.data[i], levels[i], &random);
        for (int c = 0; c < 3; ++c) out.Plane(c)[i] = color ? (*color)[c] : photo.Plane(c)[i];
      }
    });
    const std::vector<float> now = GrayLevels(out);
    for (size_t i = 0; i < levels.size(); ++i) wrong[i] = now[i] != levels[i] ? 1 : 0;
  }
  return out;
}

std::string GrayCopy(const Image& srgb) {
  Image gray = LuminanceFromSrgb(srgb);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return EncodePng16(gray);
}

class GuardTest : public ServiceTest {
 protected:
  // Digest of the coloured model of a benchmark on its own server.
  std::string ModelOf(const std::string& room) {
    StopServer();
    std::filesystem::remove_all(Path("server"));
    StartServer();
    const ProcessResult result = Client(std::vector<std::string>{"colorize",
                                                                 Path(room).string(),
                                                                 "-o",
                                                                 Path("out_" + room).string(),
                                                                 "--benchmark",
                                                                 "--bound",
                                                                 "--key-view",
                                                                 "view003"} +
                                        QuickOptions());
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    const v1::Job job = NewestJob("solve_chroma");
    for (const v1::Artifact& artifact : job.artifacts()) {
      if (artifact.name() == "model.c3g") return artifact.digest().sha256();
    }
    ADD_FAILURE() << "no model";
    return "";
  }
  json Metrics(const std::string& room) {
    return json::parse(ReadFile(Path("out_" + room) / "metrics.json"));
  }
};

// Only the key view's colours may reach the model of a benchmark.
TEST_F(GuardTest, ColorsOfOtherPhotosDoNotReachTheModel) {
  ProceduralSceneOptions options = SmallRoom(5);
  options.width = 160;
  options.height = 120;
  WriteProceduralScene(Path("first"), options);
  WriteProceduralScene(Path("second"), options);
  for (int i = 0; i < options.views; ++i) {
    if (i == 3) continue;  // the key view
    const std::string name = "images/view00" + std::to_string(i) + ".png";
    const Image photo = ReadImage(Path("first") / name);
    WriteFileAtomic(Path("second") / name,
                    EncodePng16(Repainted(photo, static_cast<uint64_t>(i + 1))));
    const Image written = ReadImage(Path("second") / name);
    ASSERT_TRUE(GrayCopy(written) == GrayCopy(photo)) << name << ": L differs";
    size_t changed = 0;
    for (size_t k = 0; k < photo.data.size(); ++k) {
      changed += std::abs(written.data[k] - photo.data[k]) > 0.02f ? 1 : 0;
    }
    EXPECT_GT(changed, photo.data.size() / 2) << name;
  }
  // Colour pictures that the job must not request.
  for (const char* room : {"first", "second"}) {
    std::filesystem::create_directories(Path(room) / "augment");
    std::filesystem::copy_file(Path(room) / "images/view001.png", Path(room) / "augment/a.png");
  }
  const std::string first = ModelOf("first"), second = ModelOf("second");
  EXPECT_EQ(first, second);
  const json before = Metrics("first"), after = Metrics("second");
  EXPECT_EQ(before.at("key_views"), json({"view003.png"}));
  EXPECT_TRUE(before.at("augmentations").empty());
  EXPECT_GT(before.at("share_seen_scored").get<double>(), 0.0);
  EXPECT_NE(before.at("delta_e00"), after.at("delta_e00")) << "the truth did not change";
}

}  // namespace
}  // namespace color3d
