#include "client/lib/photos/skipped_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/photos/mask_files.h"
#include "client/lib/photos/photo_folder.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "tests/support/formats/picture_files.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// First bytes of a HEIC file, as left by exports whose pictures are stored in a cloud.
const std::string kStub = std::string(
                              "\0\0\0\x18"
                              "ftypheic\0\0\0\0mif1heic",
                              24) +
                          std::string(64, '\0');

class SkippedFilesTest : public ::testing::Test {
 protected:
  void Write(const std::string& path, const std::string& bytes = "x") {
    fs::create_directories((root() / path).parent_path());
    WriteFileAtomic(root() / path, bytes);
  }
  fs::path root() const { return scratch_.path() / "photos"; }
  std::vector<std::string> Photos() {
    std::vector<std::string> paths;
    for (const LocalFile& photo : CollectPhotos(root()).photos) paths.push_back(photo.path);
    return paths;
  }
  std::vector<std::string> Notes() { return CollectPhotos(root()).notes; }
  std::string Refusal() {
    try {
      CollectPhotos(root());
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

 private:
  ScratchFolder scratch_;
};

TEST_F(SkippedFilesTest, CountsUnsupportedPicturesWithRemedy) {
  for (const char* name : {"a.jpg",
                           "b.jpg",
                           "c.NEF",
                           "d.nef",
                           "e.cr3",
                           "f.dng",
                           "g.psd",
                           "h.dpx",
                           "i.gif",
                           "j.avif",
                           "k.jxl",
                           "l.exr",
                           "m.jp2",
                           "n.pdf",
                           "o.tga"}) {
    Write(name);
  }
  EXPECT_THAT(Photos(), ElementsAre("a.jpg", "b.jpg"));
  const std::vector<std::string> notes = Notes();
  EXPECT_EQ(notes.size(), 10u);
  EXPECT_THAT(
      notes[0],
      AllOf(HasSubstr("raw files skipped: 4 (c.NEF, d.nef, e.cr3, ...)"), HasSubstr("darktable")));
  for (const char* kind : {"files of paint programs",
                           "DPX",
                           "GIF",
                           "AVIF",
                           "JPEG XL",
                           "HDR",
                           "JPEG 2000",
                           "documents",
                           "other formats"}) {
    EXPECT_THAT(notes, Contains(HasSubstr(kind))) << kind;
  }
}

TEST_F(SkippedFilesTest, ReportsHeicStubsAndKeepsOthers) {
  Write("a.jpg"), Write("b.jpg"), Write("c.HEIC", kStub), Write("d.heic", kStub);
  EXPECT_THAT(Photos(), ElementsAre("a.jpg", "b.jpg"));
  EXPECT_THAT(
      Notes(),
      ElementsAre(AllOf(
          HasSubstr("HEIC pictures"), HasSubstr("2 (c.HEIC, d.heic)"), HasSubstr("heif-convert"))));
  fs::remove(root() / "a.jpg"), fs::remove(root() / "b.jpg");
  EXPECT_THAT(Refusal(),
              AllOf(HasSubstr("contains no photographs"),
                    HasSubstr("2 (c.HEIC, d.heic)"),
                    HasSubstr("heif-convert")));
}

TEST_F(SkippedFilesTest, TakesHeicWebpAndBmpWithoutCopies) {
  const std::string heic = HeicFile(Image(64, 64, 3, 0.5f));
  const bool reads_heic = !heic.empty();
  Write("a.jpg"), Write("b.bmp"), Write("c.webp"), Write("e.png");
  if (reads_heic) Write("d.heic", heic);
  EXPECT_THAT(Photos(), Contains("b.bmp"));
  EXPECT_THAT(Photos(), Contains("c.webp"));
  EXPECT_EQ(Photos().size(), reads_heic ? 5u : 4u);
  EXPECT_THAT(Notes(), IsEmpty());
  Write("A.webp"), Write("e.BMP");
  if (reads_heic) Write("a.heic", heic);
  EXPECT_EQ(Photos().size(), reads_heic ? 5u : 4u);
  EXPECT_THAT(Notes(),
              ElementsAre(HasSubstr("pictures beside another of the same name "
                                    "skipped: " +
                                    std::string(reads_heic ? "3" : "2"))));
}

TEST_F(SkippedFilesTest, SkipsThumbnailsOfOtherPrograms) {
  for (const char* name : {"images/a.jpg",
                           "images/left/b.jpg",
                           "images/@eaDir/a.jpg/SYNOPHOTO_THUMB_XL.jpg",
                           "images/left/@eaDir/b.jpg",
                           "images/__MACOSX/a.jpg",
                           "images/.thumbnails/a.jpg",
                           "images/Thumbnails/a.png",
                           "images/#recycle/z.jpg",
                           "images/lost+found/z.jpg",
                           "images/._a.jpg",
                           "images/Thumbs.db",
                           "images/.DS_Store"}) {
    Write(name);
  }
  EXPECT_THAT(Photos(), ElementsAre("images/a.jpg", "images/left/b.jpg"));
  EXPECT_THAT(Notes(),
              ElementsAre(HasSubstr("folders that programs keep for thumbnails and the "
                                    "like skipped: 7 ("),
                          HasSubstr("hidden pictures skipped: 1 (._a.jpg)")));
}

TEST_F(SkippedFilesTest, FollowsOrReportsLinks) {
  Write("images/a.jpg"), Write("images/b.jpg"), Write("elsewhere/c.jpg");
  fs::create_symlink(root() / "elsewhere/c.jpg", root() / "images/c.jpg");
  fs::create_symlink(root() / "gone.jpg", root() / "images/d.jpg");
  fs::create_symlink(root() / "images/e.jpg", root() / "images/e.jpg");
  fs::create_directory_symlink(root() / "elsewhere", root() / "images/more");
  fs::create_directory_symlink(root(), root() / "images/loop");
  EXPECT_THAT(Photos(), ElementsAre("images/a.jpg", "images/b.jpg", "images/c.jpg"));
  EXPECT_THAT(Notes(),
              ElementsAre(HasSubstr("links that lead nowhere skipped: 2 (d.jpg, e.jpg)"),
                          HasSubstr("links to folders skipped: 2 (loop, more)")));
}

TEST_F(SkippedFilesTest, SkipsResults) {
  for (const char* name : {"a.jpg",
                           "b.jpg",
                           "key_view.png",
                           "key_view.json",
                           "key_view_ranking.jpg",
                           "key_view_colored.png",
                           "renders/a.png",
                           "augmentations.jpg"}) {
    Write(name);
  }
  EXPECT_THAT(Photos(), ElementsAre("a.jpg", "b.jpg"));
  EXPECT_THAT(Notes(),
              Contains(AllOf(HasSubstr("results of color3d skipped: 4"), HasSubstr("-o"))));
  // Below images/, skips folders of results, but no other folders of their names.
  for (const char* name : {"images/a.jpg",
                           "images/b.jpg",
                           "images/metrics.json",
                           "images/renders/a.png",
                           "images/film_frames/a.png",
                           "images/left/frames/c.jpg"}) {
    Write(name);
  }
  EXPECT_THAT(Photos(), ElementsAre("images/a.jpg", "images/b.jpg", "images/left/frames/c.jpg"));
}

TEST_F(SkippedFilesTest, SkipsOwnFilmsAndSplats) {
  for (const char* name : {"walk.mov",
                           "film.mp4",
                           "scene.mp4",
                           "scene.ply",
                           "scene.sog",
                           "metrics.json",
                           "report.html"}) {
    Write(name, name);  // equal films would be copies
  }
  const PhotoFolder folder = CollectPhotos(root());
  EXPECT_FALSE(folder.splat.has_value());
  EXPECT_TRUE(folder.camera_films.empty());
  ASSERT_TRUE(folder.film.has_value());
  EXPECT_EQ(folder.film->path, "walk.mov");
  // Without a record of results they are films of the user.
  fs::remove(root() / "metrics.json"), fs::remove(root() / "report.html");
  EXPECT_EQ(CollectPhotos(root()).camera_films.size(), 3u);
}

TEST_F(SkippedFilesTest, ReportsUnusedNeighbors) {
  for (const char* name : {"a.jpg",
                           "b.jpg",
                           "a.mov",
                           "walk.mp4",
                           "more/c.jpg",
                           "more/d.jpg",
                           "masks/a.png",
                           "augment/x.png",
                           "old_key/key_view.png",
                           "old_key/key_view.json"}) {
    Write(name);
  }
  EXPECT_THAT(Notes(),
              ElementsAre(HasSubstr("pictures in subfolders skipped: 2 (more/)"),
                          HasSubstr("films skipped: 1 (walk.mp4)")));
}

TEST_F(SkippedFilesTest, SkipsThumbnailsOfMasksAndAugmentations) {
  const std::string mask = EncodePng8(Image(4, 4, 1, 1.0f));
  Write("a.png", mask), Write("b.png", mask);
  Write("augment/x.png"), Write("augment/@eaDir/x.png"), Write("augment/Thumbs.db");
  Write("marks/a.png", mask), Write("marks/@eaDir/a.png", mask), Write("marks/desktop.ini");
  PhotoFolder folder = CollectPhotos(root());
  EXPECT_EQ(folder.augment_files.size(), 1u);
  AddMasks(root() / "marks", &folder);
  EXPECT_EQ(folder.mask_files.size(), 1u);
}

TEST_F(SkippedFilesTest, SkipsThumbnailsOfFrames) {
  for (const char* camera : {"left", "right", "@eaDir", "lost+found"}) {
    for (const char* name : {"1.png", "2.png"}) Write(std::string(camera) + "/" + name);
  }
  PhotoFolder folder = CollectPhotos(root(), /*as_frames=*/true);
  EXPECT_EQ(folder.photos.size(), 4u);
}

}  // namespace
}  // namespace color3d::client
