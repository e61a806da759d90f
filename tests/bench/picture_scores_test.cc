#include "tests/bench/picture_scores.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// A picture of coloured stripes, `turn` of them shifted.
Image Stripes(int width, int height, int turn) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int stripe = (x * 6 / width + turn) % 3;
      for (int c = 0; c < 3; ++c) image.At(c, y, x) = c == stripe ? 0.8f : 0.3f;
    }
  }
  return image;
}

Image GrayOf(const Image& color) {
  Image gray = color;
  for (size_t i = 0; i < color.PlaneSize(); ++i) {
    const float mean = (color.Plane(0)[i] + color.Plane(1)[i] + color.Plane(2)[i]) / 3.0f;
    for (int c = 0; c < 3; ++c) gray.Plane(c)[i] = mean;
  }
  return gray;
}

class PictureScoresTest : public ::testing::Test {
 protected:
  PictureScoresTest() {
    fs::create_directories(truth());
    fs::create_directories(pictures());
    for (int i = 0; i < 9; ++i) Write(truth(), i, Stripes(60, 40, i));
  }
  fs::path truth() const { return scratch_.path() / "truth"; }
  fs::path pictures() const { return scratch_.path() / "pictures"; }
  static void Write(const fs::path& folder, int view, const Image& image) {
    WriteFileAtomic(folder / ("v" + std::to_string(view) + ".png"), EncodePng8(image));
  }
  std::vector<PictureScores> Score(const std::vector<std::string>& views = {}) const {
    ThreadPool pool(2);
    return ScorePictures(truth(), pictures(), views, pool, CancellationToken());
  }
  std::string ErrorText(const std::vector<std::string>& views = {}) const {
    try {
      Score(views);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

 private:
  ScratchFolder scratch_;
};

TEST_F(PictureScoresTest, TrueColorsHaveNoErrorAndGrayHasThatOfGray) {
  Write(pictures(), 0, Stripes(60, 40, 0));
  Write(pictures(), 8, GrayOf(Stripes(60, 40, 8)));
  const auto scores = Score({"v0.png", "v8"});
  ASSERT_EQ(scores.size(), 2u);
  EXPECT_EQ(scores[0].view, "v0");
  EXPECT_LT(scores[0].scores.at("delta_e00"), 1e-3);
  EXPECT_GT(scores[0].scores.at("delta_e00_gray"), 5.0);
  EXPECT_NEAR(scores[1].scores.at("delta_e00_chroma"), scores[1].scores.at("delta_e00_gray"), 0.05);
}

TEST_F(PictureScoresTest, NoticesExchangedPictures) {
  Write(pictures(), 0, Stripes(60, 40, 1));
  Write(pictures(), 1, Stripes(60, 40, 0));
  for (const PictureScores& view : Score()) EXPECT_GT(view.scores.at("delta_e00_chroma"), 20.0);
}

TEST_F(PictureScoresTest, AcceptsSmallerPictures) {
  Write(pictures(), 3, Stripes(30, 20, 3));
  EXPECT_LT(Score()[0].scores.at("delta_e00_chroma"), 3.0);
}

TEST_F(PictureScoresTest, ErrorsNameFile) {
  EXPECT_THAT(ErrorText(), HasSubstr("has no pictures"));
  Write(pictures(), 0, Stripes(60, 40, 0));
  EXPECT_THAT(ErrorText({"v0", "v8"}), HasSubstr("no picture of 1 of the 2 scored views: v8"));
  EXPECT_THAT(ErrorText({"v1", "v2", "v3", "v4", "v5", "v6"}),
              HasSubstr("of the 6 scored views: v1, v2, v3, v4, v5, ..."));
  EXPECT_THAT(ErrorText({"v9"}), HasSubstr("has no photo v9"));
  Write(pictures(), 0, Stripes(40, 60, 0));
  EXPECT_THAT(ErrorText(), HasSubstr("v0.png has 40 x 60 px"));
  Write(pictures(), 0, Stripes(60, 40, 0));
  Write(pictures(), 12, Stripes(60, 40, 0));
  EXPECT_THAT(ErrorText(), HasSubstr("v12.png has no photo of its name"));
  fs::remove(pictures() / "v12.png");
  WriteFileAtomic(pictures() / "v0.jpg", EncodeJpeg(Stripes(60, 40, 0)));
  EXPECT_THAT(ErrorText(), HasSubstr("give one picture a view"));
  fs::remove(pictures() / "v0.jpg");
  Write(truth(), 0, GrayOf(Stripes(60, 40, 0)));
  EXPECT_THAT(ErrorText(), HasSubstr("v0.png is grey"));
}

}  // namespace
}  // namespace color3d
