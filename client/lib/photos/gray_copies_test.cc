#include "client/lib/photos/gray_copies.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace {

constexpr int kSide = 64;

// Smooth luminance with, for colour, hues that change across it.
Image Picture(bool color) {
  Image lab(kSide, kSide, 3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      lab.At(0, y, x) = 30.0f + 40.0f * x / kSide;
      lab.At(1, y, x) = color ? 20.0f * std::sin(0.2f * y) : 0.0f;
      lab.At(2, y, x) = color ? 20.0f * std::cos(0.3f * y) : 0.0f;
    }
  }
  return SrgbFromLab(lab);
}

class GrayCopiesTest : public ::testing::Test {
 protected:
  GrayCopiesTest() {
    const Image color = Picture(true);
    WriteFileAtomic(scratch_.path() / "a.jpg", EncodeJpeg(color, 95));
    WriteFileAtomic(scratch_.path() / "b.png", EncodePng16(color));
    WriteFileAtomic(scratch_.path() / "c.tif", EncodePng8(color));
    WriteFileAtomic(scratch_.path() / "d.png", EncodePng8(Picture(false)));
  }
  ScratchFolder scratch_;
  CancellationToken cancel_;
};

TEST_F(GrayCopiesTest, KeepLuminanceAndNames) {
  const PhotoFolder folder = CollectPhotos(scratch_.path());
  const ScratchFolder out;
  const GrayCopies copies = MakeGrayCopies(folder, out.path(), cancel_);
  ASSERT_EQ(copies.folder.photos.size(), 4u);
  for (size_t i = 0; i < folder.photos.size(); ++i) {
    const LocalFile& copy = copies.folder.photos[i];
    EXPECT_EQ(copy.path, folder.photos[i].path);
    const Image gray = ReadImage(copy.file);
    EXPECT_EQ(gray.channels, 1) << copy.path;
    const Image wanted = LuminanceFromSrgb(ReadImage(folder.photos[i].file));
    const Image got = LuminanceFromSrgb(gray);
    ASSERT_EQ(got.data.size(), wanted.data.size()) << copy.path;
    // JPEG loses a little; 16 bits next to nothing.
    const float tolerance = copy.path == "a.jpg" ? 1.5f : 0.01f;
    for (size_t k = 0; k < got.data.size(); ++k) {
      ASSERT_NEAR(got.data[k], wanted.data[k], tolerance) << copy.path;
    }
  }
  EXPECT_EQ(copies.in_color, (std::set<std::string>{"a.jpg", "b.png", "c.tif"}));
}

TEST_F(GrayCopiesTest, CountsColor) {
  const ColorCount count = CountColorPhotos(CollectPhotos(scratch_.path()), 24, cancel_);
  EXPECT_EQ(count.photos, 4);
  EXPECT_EQ(count.looked_at, 4);
  EXPECT_EQ(count.in_color, 3);
  EXPECT_TRUE(count.MostlyColor());
  EXPECT_EQ(CountColorPhotos(CollectPhotos(scratch_.path()), 2, cancel_).looked_at, 2);
}

TEST_F(GrayCopiesTest, StopWhenCancelled) {
  cancel_.Cancel();
  const ScratchFolder out;
  EXPECT_THROW(MakeGrayCopies(CollectPhotos(scratch_.path()), out.path(), cancel_), Error);
}

}  // namespace
}  // namespace color3d::client
