// Masks of photos through the service: masked pixels count neither in training nor in scores.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/scenes/procedural_scene.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kLeft = 60, kTop = 50, kRight = 180, kBottom = 140;

class MasksTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }

  // A room with a different object in front of it in every photo, and masks of these objects.
  void WriteSpoiltRoom() {
    WriteProceduralScene(Path("room"), SmallRoom());
    fs::create_directories(Path("masks"));
    std::mt19937 random(7);
    std::uniform_real_distribution<float> gray(0.0f, 1.0f);
    for (const std::string& file : ListFiles(Path("room") / "images")) {
      Image photo = ReadImage(Path("room") / "images" / file);
      Image mask(photo.width, photo.height, 1, 1.0f);
      const float block = gray(random);
      for (int y = kTop; y < kBottom; ++y) {
        for (int x = kLeft; x < kRight; ++x) {
          mask.At(0, y, x) = 0.0f;
          const float v = 0.5f * block + 0.5f * gray(random);
          for (int c = 0; c < 3; ++c) photo.At(c, y, x) = v;
        }
      }
      WriteFileAtomic(Path("room") / "images" / file, EncodePng8(photo));
      WriteFileAtomic(Path("masks") / file, EncodePng8(mask));
    }
  }
  ProcessResult Colorize(const std::string& out, const std::vector<std::string>& more = {}) {
    return Client(std::vector<std::string>{
                      "colorize", Path("room").string(), "-o", Path(out).string(), "--benchmark"} +
                  QuickOptions() + more);
  }
  nlohmann::json Metrics(const std::string& out) {
    return nlohmann::json::parse(ReadFile(Path(out) / "metrics.json"));
  }
};

TEST_F(MasksTest, LeavesOutMaskedForeground) {
  WriteSpoiltRoom();
  const ProcessResult plain = Colorize("plain");
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  const ProcessResult masked = Colorize("masked", {"--masks", Path("masks").string()});
  ASSERT_EQ(masked.exit_code, 0) << masked.out << masked.err;
  const double plain_db = Metrics("plain").at("psnr_l"), masked_db = Metrics("masked").at("psnr_l");
  std::printf("PSNR of L: %.2f dB, with masks %.2f dB\n", plain_db, masked_db);
  EXPECT_GT(masked_db, plain_db + 3.0);
  EXPECT_LT(Metrics("masked").at("delta_e00_chroma"), Metrics("plain").at("delta_e00_gray"));
  EXPECT_THAT(masked.out + masked.err, HasSubstr("photos have masks"));
  // No stroke is proposed on masked pixels.
  const ProcessResult stroke = Client({"correct",
                                       Path("masked").string(),
                                       "--view",
                                       "view002",
                                       "--at",
                                       "120,95",
                                       "--color",
                                       "#ff2020",
                                       "--radius",
                                       "8"});
  EXPECT_NE(stroke.exit_code, 0);
  EXPECT_THAT(stroke.err, HasSubstr("masked out"));
}

TEST_F(MasksTest, RefusesBadMasksByName) {
  WriteSpoiltRoom();
  const std::string first = ListFiles(Path("masks")).at(0);
  const std::vector<std::string> options = {"--masks", Path("masks").string()};
  WriteFileAtomic(Path("masks") / first, EncodePng8(Image(8, 8, 1, 1.0f)));
  const ProcessResult small = Colorize("out", options);
  EXPECT_EQ(small.exit_code, 2);
  EXPECT_THAT(small.err, HasSubstr(first));
  EXPECT_THAT(small.err, HasSubstr("8 x 8 px"));
  const Image photo = ReadImage(Path("room") / "images" / first);
  WriteFileAtomic(Path("masks") / first, EncodePng8(Image(photo.width, photo.height, 1, 0.0f)));
  const ProcessResult black = Colorize("out", options);
  EXPECT_NE(black.exit_code, 0);
  EXPECT_THAT(black.err, HasSubstr("masks out the whole photo"));
  EXPECT_FALSE(fs::exists(Path("out") / "scene.ply"));
  Image clear(photo.width, photo.height, 4, 0.5f);
  std::fill_n(clear.Plane(3), clear.PlaneSize(), 0.0f);
  WriteFileAtomic(Path("room") / "images" / first, EncodePng8(clear));
  const ProcessResult transparent = Colorize("out");
  EXPECT_NE(transparent.exit_code, 0);
  EXPECT_THAT(transparent.err, HasSubstr(first));
  EXPECT_THAT(transparent.err, HasSubstr("masks out the whole photo"));
}

}  // namespace
}  // namespace color3d
