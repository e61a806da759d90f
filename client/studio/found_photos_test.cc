#include "client/studio/found_photos.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;

class FoundPhotosTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(scratch_.path() / name, std::ios::binary) << bytes;
  }
  void WritePhotos() const {
    for (const char* name : {"a.jpg", "b.jpg"}) Write(name, EncodeJpeg(Image(60, 40, 3, 0.5f)));
  }
  const ScratchFolder scratch_;
  const CancellationToken cancel_{};
};

TEST_F(FoundPhotosTest, NamesWhatIsThere) {
  WritePhotos();
  Write("c.jpg", "no picture");
  Write("notes.txt", "text");
  const auto found = DescribePhotos(CollectPhotos(scratch_.path()), cancel_);
  EXPECT_EQ(found["kind"], "photos");
  ASSERT_EQ(found["photos"].size(), 3u);
  EXPECT_EQ(found["photos"][0]["name"], "a.jpg");
  EXPECT_EQ(found["photos"][0]["width"], 60);
  EXPECT_THAT(found["photos"][2]["problem"].get<std::string>(), HasSubstr("c.jpg"));
  EXPECT_TRUE(found["in_color"].is_null()) << "not all can be read";
}

TEST_F(FoundPhotosTest, TellsMonochromeFromColor) {
  WritePhotos();
  EXPECT_EQ(DescribePhotos(CollectPhotos(scratch_.path()), cancel_)["in_color"], false);
}

TEST_F(FoundPhotosTest, MakesSmallPictures) {
  WritePhotos();
  const PhotoFolder folder = CollectPhotos(scratch_.path());
  EXPECT_THROW(PhotoOfView(folder, "z.jpg"), Error);
  const LocalFile& photo = PhotoOfView(folder, "b.png");  // by its stem
  EXPECT_EQ(photo.file.filename(), "b.jpg");
  EXPECT_EQ(DecodeImage(PhotoJpeg(photo, 30, false), "small").width, 30);
  EXPECT_EQ(DecodeImage(PhotoJpeg(photo, 0, true), "gray").channels, 1);
}

}  // namespace
}  // namespace color3d::client
