// Several key views, through the whole service.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

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

// Larger than what the colorizer trains on, so that carried colours and their confidences, which
// are 1 in the further key views, are reduced on the way (334 px to 267: the mean of ones rounds to
// above 1).
TEST_F(KeyViewsTest, ThreeKeyViewsGoThrough) {
  ProceduralSceneOptions room = SmallRoom(6, /*gray=*/true);
  room.width = 500;
  room.height = 334;
  WriteProceduralScene(Path("room"), room);
  const ProcessResult result = Client({"colorize",
                                       Path("room").string(),
                                       "-o",
                                       Path("out").string(),
                                       "--key-color",
                                       Truth("view002.png"),
                                       "--more-key",
                                       "view000.png=" + Truth("view000.png"),
                                       "--more-key",
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
                                       "10"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(NewestJob("carry_color").spec().carry_color().further_key_views_size(), 2);
}

TEST_F(KeyViewsTest, ABenchmarkChoosesSeveralAndTheGeometryIsMadeOnce) {
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
  ExpectRefusal(benchmark("more", {"--keys", "2", "--more-key", "view001=auto"}),
                2,
                {"leave out --more-key"});
  ExpectRefusal(benchmark("none", {"--more-key", "view099=auto"}), 2, {"view099"});
  ExpectRefusal(benchmark("same", {"--key-view", "view004", "--more-key", "view004.png=auto"}),
                2,
                {"the key view already"});
  ExpectRefusal(benchmark("held", {"--key-view", "view000"}), 2, {"view000", "held out"});
  ExpectRefusal(benchmark("held2", {"--key-view", "view004", "--more-key", "view000=auto"}),
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

// What the service is given of a photo in a benchmark: its L, in 16 bits.
float GrayLevel(const Image& srgb) {
  return static_cast<float>(GrayFromLuminance(LuminanceFromSrgb(srgb).data[0]));
}

// A pixel of another chroma whose L is the same to the last of 16 bits, rounding included.
std::array<float, 3> SameLuminance(const std::array<float, 3>& from, Random* random) {
  Image pixel(1, 1, 3);
  const auto gray_of = [&](const std::array<float, 3>& rgb) {
    std::copy(rgb.begin(), rgb.end(), pixel.data.begin());
    return GrayLevel(pixel);
  };
  const float wanted = std::round(gray_of(from) * 65535.0f) / 65535.0f;
  for (int attempt = 0; attempt < 50; ++attempt) {
    Image lab(1, 1, 3);
    std::copy(from.begin(), from.end(), pixel.data.begin());
    lab.data[0] = LuminanceFromSrgb(pixel).data[0];
    for (int c = 1; c < 3; ++c) lab.data[c] = static_cast<float>(random->NextUniform(-50, 50));
    const Image made = SrgbFromLab(lab);
    std::array<float, 3> rgb = {made.data[0], made.data[1], made.data[2]};
    // Green, then blue, which has a tenth of its weight, to the middle of the rounding interval.
    for (const int channel : {1, 1, 2, 2, 2, 2}) {
      const float weight = channel == 1 ? 0.7f : 0.07f;
      rgb[channel] += (wanted - gray_of(rgb)) / weight;
      for (float& value : rgb) {
        value = std::clamp(std::round(value * 65535.0f) / 65535.0f, 0.0f, 1.0f);
      }
      if (std::abs(gray_of(rgb) - wanted) < 0.3f / 65535.0f) return rgb;
    }
  }
  return from;
}

// Random chroma in every pixel of a photo, the same grey copy.
Image Repainted(const Image& photo, uint64_t seed) {
  Image out = photo;
  ThreadPool pool(2);
  pool.ForEach(photo.height, [&](int64_t y, int) {
    Random random(seed, static_cast<uint64_t>(y));
    for (int x = 0; x < photo.width; ++x) {
      const int row = static_cast<int>(y);
      const auto rgb =
          SameLuminance({photo.At(0, row, x), photo.At(1, row, x), photo.At(2, row, x)}, &random);
      for (int c = 0; c < 3; ++c) out.At(c, row, x) = rgb[c];
    }
  });
  return out;
}

std::string GrayCopy(const Image& srgb) {
  Image gray = LuminanceFromSrgb(srgb);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return EncodePng16(gray);
}

class GuardTest : public ServiceTest {
 protected:
  // Digest of the coloured model that a benchmark leaves on a server of its own.
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

// Nothing but the key view's colours may reach a benchmark's model.
TEST_F(GuardTest, ColoursOfOtherPhotosDoNotReachTheModel) {
  ProceduralSceneOptions options = SmallRoom(5);
  options.width = 160;
  options.height = 120;
  WriteProceduralScene(Path("first"), options);
  WriteProceduralScene(Path("second"), options);
  for (int i = 0; i < options.views; ++i) {
    const std::string name = "images/view00" + std::to_string(i) + ".png";
    const Image photo = ReadImage(Path("first") / name);
    const Image other = i == 3 ? photo : Repainted(photo, static_cast<uint64_t>(i + 1));
    WriteFileAtomic(Path("second") / name, EncodePng16(other));
    const Image written = ReadImage(Path("second") / name);
    ASSERT_EQ(GrayCopy(written), GrayCopy(photo)) << name << ": not the same L";
    size_t changed = 0;
    for (size_t k = 0; k < photo.data.size(); ++k) {
      changed += std::abs(written.data[k] - photo.data[k]) > 0.02f ? 1 : 0;
    }
    EXPECT_EQ(i != 3, changed > photo.data.size() / 2) << name;
  }
  // Pictures in colour that nobody asks for.
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
  EXPECT_NE(before.at("delta_e00"), after.at("delta_e00")) << "the truth is another";
}

}  // namespace
}  // namespace color3d
