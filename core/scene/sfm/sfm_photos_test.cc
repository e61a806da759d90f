#include "core/scene/sfm/sfm_photos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/test_exif.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

TEST(FeatureImages, StretchesLowContrastPhotosOnly) {
  Image dull = GradientPhoto(64, 64, 1);
  for (float& v : dull.data) v = 0.4f + 0.1f * v;
  const Image stretched = FeatureImage(dull, 1000);
  const auto [low, high] = std::minmax_element(stretched.data.begin(), stretched.data.end());
  EXPECT_GT(*high - *low, 0.9f);
  const Image bright = GradientPhoto(64, 64, 1);
  EXPECT_EQ(FeatureImage(bright, 1000).data, bright.data);
  EXPECT_EQ(FeatureImage(GradientPhoto(64, 48, 3), 32).width, 32);
  for (float v : FeatureImage(Image(8, 8, 1, 0.5f), 100).data) EXPECT_LE(v, 1.0f);
}

// Photos of one camera share its focal length; those of another zoom or size do not.
TEST(FeatureImages, AreGroupedByCamera) {
  const ScratchFolder folder;
  const ScratchFolder scratch;
  std::vector<Photo> photos;
  const auto add = [&](const std::string& name, int width, uint32_t film_mm) {
    const std::string jpeg = EncodeJpeg(GradientPhoto(width, 60, 1));
    WriteFileAtomic(folder.path() / name,
                    film_mm > 0 ? WithExif(jpeg, {{41989, 3, film_mm}}) : jpeg);
    photos.push_back({name, name});
    ProbePhoto(folder.path(), &photos.back());
  };
  add("a.jpg", 80, 28);
  add("b.jpg", 80, 28);
  add("c.jpg", 80, 50);
  add("d.jpg", 80, 0);
  add("e.jpg", 100, 28);
  EXPECT_NEAR(photos[0].focal_px, 28.0 * 100.0 / 43.2666, 0.1);
  QuietRun run(2);
  const FeatureImages written = WriteFeatureImages(photos,
                                                   folder.path(),
                                                   scratch.path() / "copies",
                                                   scratch.path() / "masks",
                                                   40,
                                                   50,
                                                   run.control());
  ASSERT_EQ(written.groups.size(), 4u);
  EXPECT_EQ(written.groups[0].names,
            (std::vector<std::string>{written.names[0], written.names[1]}));
  EXPECT_NEAR(written.groups[0].focal_px, 14.0 * 100.0 / 43.2666, 0.1);
  EXPECT_EQ(written.groups[2].focal_px, 0.0);
  EXPECT_EQ(written.features.size(), 5u);
  for (const std::string& name : written.names) {
    const Image copy = ReadImage(scratch.path() / "copies" / name);
    EXPECT_EQ(copy.width, 40);
    EXPECT_EQ(copy.channels, 1);
  }
}

}  // namespace
}  // namespace color3d
