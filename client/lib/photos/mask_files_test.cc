#include "client/lib/photos/mask_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/photos/gray_copies.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class MaskFilesTest : public ::testing::Test {
 protected:
  MaskFilesTest() {
    for (const char* name : {"images/a.jpg", "images/sub/b.jpg", "images/c.jpg"}) {
      Write(root() / name, EncodeJpeg(Image(24, 16, 3, 0.5f)));
    }
  }
  static void Write(const fs::path& path, const std::string& bytes) {
    fs::create_directories(path.parent_path());
    WriteFileAtomic(path, bytes);
  }
  void WriteMask(const std::string& name, int width = 24, int height = 16) {
    Write(masks() / name, EncodePng8(Image(width, height, 1, 1.0f)));
  }
  fs::path root() const { return scratch_.path() / "scene"; }
  fs::path masks() const { return scratch_.path() / "masks"; }
  std::string ErrorOf() {
    PhotoFolder folder = CollectPhotos(root());
    try {
      AddMasks(masks(), &folder);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

 private:
  ScratchFolder scratch_;
};

TEST_F(MaskFilesTest, AcceptsEitherName) {
  WriteMask("a.png");
  WriteMask("sub/b.jpg.png");
  PhotoFolder folder = CollectPhotos(root());
  AddMasks(masks(), &folder);
  ASSERT_EQ(folder.mask_files.size(), 2u);
  EXPECT_EQ(folder.mask_files[0].path, "masks/a.png");
  EXPECT_EQ(folder.mask_files[1].path, "masks/sub/b.jpg.png");
  EXPECT_EQ(folder.mask_files[1].file, masks() / "sub/b.jpg.png");
  EXPECT_EQ(folder.AllFiles().size(), 5u);
  EXPECT_THAT(folder.notes, ::testing::Contains("2 of 3 photos have masks"));
}

TEST_F(MaskFilesTest, LeavesOutMasksOfDeletedPhotosWithNote) {
  WriteMask("A.PNG");
  WriteMask("gone.png");
  PhotoFolder folder = CollectPhotos(root());
  AddMasks(masks(), &folder);
  ASSERT_EQ(folder.mask_files.size(), 1u);
  EXPECT_EQ(folder.mask_files[0].path, "masks/A.PNG");
  EXPECT_THAT(folder.notes, ::testing::Contains(HasSubstr("1 of 2 masks match no photo")));
}

TEST_F(MaskFilesTest, NamesFilesThatAreNoMasks) {
  EXPECT_THAT(ErrorOf(), HasSubstr("no such folder"));
  fs::create_directories(masks());
  EXPECT_THAT(ErrorOf(), HasSubstr("no mask in it"));
  WriteMask("d.png");
  EXPECT_THAT(ErrorOf(), AllOf(HasSubstr("d.png"), HasSubstr("matches no photo")));
  fs::remove(masks() / "d.png");
  WriteMask("a.png", 16, 24);
  EXPECT_THAT(ErrorOf(), AllOf(HasSubstr("16 x 24 px"), HasSubstr("24 x 16 px")));
  Write(masks() / "a.png", "no picture");
  EXPECT_THAT(ErrorOf(), AllOf(HasSubstr("a.png"), HasSubstr("not an image")));
  Write(masks() / "a.png", EncodeJpeg(Image(24, 16, 1, 1.0f)));
  EXPECT_THAT(ErrorOf(), HasSubstr("not a PNG"));
  WriteMask("a.png");
  WriteMask("a.jpg.png");
  EXPECT_THAT(ErrorOf(), AllOf(HasSubstr("two masks"), HasSubstr("a.jpg")));
}

// The benchmark uploads grey copies, which have no alpha.
TEST_F(MaskFilesTest, GrayCopiesKeepAlpha) {
  Image photo(24, 16, 4, 1.0f);
  photo.At(3, 5, 7) = 0.0f;
  Write(root() / "images/d.png", EncodePng8(photo));
  Write(root() / "images/e.png", EncodePng8(Image(24, 16, 4, 1.0f)));
  const ScratchFolder scratch;
  const GrayCopies copies = MakeGrayCopies(CollectPhotos(root()), scratch.path(), {});
  ASSERT_EQ(copies.folder.mask_files.size(), 1u);
  EXPECT_EQ(copies.folder.mask_files[0].path, "masks/d.png.png");
  const Image mask = ReadImage(copies.folder.mask_files[0].file);
  EXPECT_EQ(mask.At(0, 5, 7), 0.0f);
  EXPECT_EQ(mask.At(0, 6, 7), 1.0f);
}

}  // namespace
}  // namespace color3d::client
