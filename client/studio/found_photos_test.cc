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

TEST(SizeNotesTest, NameOddPhotos) {
  const auto photo = [](const char* name, int width, int height) {
    return nlohmann::ordered_json{{"name", name}, {"width", width}, {"height", height}};
  };
  const nlohmann::ordered_json even = {photo("a", 90, 60), photo("b", 90, 60), photo("c", 90, 60)};
  EXPECT_TRUE(SizeNotes(even).empty());
  nlohmann::ordered_json odd = even;
  odd.push_back(photo("d.jpg", 60, 90));
  odd.push_back(photo("scan.png", 20000, 10000));
  const auto notes = SizeNotes(odd);
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_NE(notes[0].find("d.jpg: 60 x 90 px, unlike most of the photos (90 x 60 px)"),
            std::string::npos);
  EXPECT_NE(notes[1].find("scan.png: 20000 x 10000 px, which takes much memory"),
            std::string::npos);
  // Where no size is that of most, none is odd.
  EXPECT_TRUE(SizeNotes({photo("a", 1, 2), photo("b", 2, 1), photo("c", 3, 1)}).empty());
}

}  // namespace
}  // namespace color3d::client
