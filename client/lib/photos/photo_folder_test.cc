#include "client/lib/photos/photo_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PhotoFolderTest : public ::testing::Test {
 protected:
  void Write(const std::string& path, const std::string& bytes = "x") {
    fs::create_directories((root() / path).parent_path());
    WriteFileAtomic(root() / path, bytes);
  }
  fs::path root() const { return scratch_.path() / "scene"; }

  static std::vector<std::string> Paths(const std::vector<LocalFile>& files) {
    std::vector<std::string> paths;
    for (const LocalFile& file : files) paths.push_back(file.path);
    return paths;
  }
  std::string ErrorOf(const fs::path& path, bool as_frames = false) {
    try {
      CollectPhotos(path, as_frames);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

 private:
  ScratchFolder scratch_;
};

TEST_F(PhotoFolderTest, TakesPhotosOnly) {
  for (const char* name : {"b.JPG", "a.jpg", "c.tiff", "notes.txt", ".hidden.jpg", "sub/d.jpg"}) {
    Write(name);
  }
  const PhotoFolder folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.photos), ElementsAre("a.jpg", "b.JPG", "c.tiff"));
  EXPECT_THAT(folder.model_files, IsEmpty());
  EXPECT_THAT(folder.notes,
              ElementsAre(HasSubstr("hidden pictures skipped: 1 (.hidden.jpg)"),
                          HasSubstr("pictures in subfolders skipped: 1 (sub/)")));
}

TEST_F(PhotoFolderTest, PrefersImagesFolderAtAnyDepth) {
  for (const char* name : {"preview.jpg", "images/a.jpg", "images/left/b.png"}) Write(name);
  EXPECT_THAT(Paths(CollectPhotos(root()).photos),
              ElementsAre("images/a.jpg", "images/left/b.png"));
}

TEST_F(PhotoFolderTest, AugmentPicturesAreNoPhotos) {
  for (const char* name : {"a.jpg", "b.jpg", "augment/x.png", "augment/deep/y.jpg"}) Write(name);
  const PhotoFolder folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.photos), ElementsAre("a.jpg", "b.jpg"));
  EXPECT_THAT(Paths(folder.augment_files), ElementsAre("augment/deep/y.jpg", "augment/x.png"));
  EXPECT_EQ(folder.AllFiles().size(), 4u);
  Write("augment/notes.txt");
  EXPECT_THAT(ErrorOf(root()), HasSubstr("augment/notes.txt is not a picture"));
}

TEST_F(PhotoFolderTest, TakesSplatInsteadOfPhotos) {
  Write("bust.ply");
  Write("notes.txt");
  for (const fs::path& path : {root() / "bust.ply", root()}) {
    const PhotoFolder folder = CollectPhotos(path);
    ASSERT_TRUE(folder.splat.has_value());
    EXPECT_EQ(folder.Name(), "bust.ply");
    EXPECT_EQ(folder.Layout(), CaptureLayout::kSplat);
    EXPECT_THAT(Paths(folder.AllFiles()), ElementsAre("bust.ply"));
    EXPECT_EQ(FindPhotoByStem(folder, "x/view_07.png"), "view_07.png");
    EXPECT_EQ(FindPhotoByStem(folder, "x/coloured.png"), "");
    RequirePhoto(folder, "view_07");
  }
  EXPECT_THAT(ErrorOf(root() / "notes.txt"), HasSubstr("a splat (.ply, .sog or .spz) or a film"));
  Write("other.SOG");
  EXPECT_THAT(ErrorOf(root()), HasSubstr("2 splats"));
  for (const char* name : {"a.jpg", "b.jpg"}) Write(name);
  EXPECT_FALSE(CollectPhotos(root()).splat.has_value());
}

TEST_F(PhotoFolderTest, TakesFilmOrPhotosAsFrames) {
  Write("walk.MOV");
  Write("notes.txt");
  for (const fs::path& path : {root() / "walk.MOV", root()}) {
    PhotoFolder folder = CollectPhotos(path);
    ASSERT_TRUE(folder.film.has_value());
    EXPECT_EQ(folder.Name(), "walk.MOV");
    EXPECT_EQ(folder.Layout(), CaptureLayout::kFilm);
    EXPECT_THAT(Paths(folder.AllFiles()), ElementsAre("walk.MOV"));
    EXPECT_EQ(FindPhotoByStem(folder, "x/f000012.png"), "f000012.png");
    EXPECT_EQ(FindPhotoByStem(folder, "x/fox.png"), "");
    RequirePhoto(folder, "f000003");
    UsePhotosAsFrames(&folder);
    EXPECT_TRUE(folder.film.has_value());
  }
  Write("second.mp4", "y");
  PhotoFolder cameras = CollectPhotos(root());
  EXPECT_THAT(Paths(cameras.AllFiles()), ElementsAre("second.mp4", "walk.MOV"));
  EXPECT_EQ(cameras.Layout(), CaptureLayout::kFilms);
  EXPECT_FALSE(cameras.film.has_value());
  EXPECT_THROW(UsePhotosAsFrames(&cameras), Error);
  for (const char* name : {"images/b.jpg", "images/a.jpg"}) Write(name);
  PhotoFolder folder = CollectPhotos(root());
  EXPECT_FALSE(folder.film.has_value());
  EXPECT_EQ(folder.Layout(), CaptureLayout::kPhotos);
  UsePhotosAsFrames(&folder);
  EXPECT_EQ(folder.Layout(), CaptureLayout::kFilm);
  EXPECT_THAT(Paths(folder.photos), ElementsAre("frames/a.jpg", "frames/b.jpg"));
  EXPECT_EQ(FindPhotoByStem(folder, "b.png"), "b.jpg");
  for (const char* name : {"images/c10.jpg", "images/c2.jpg"}) Write(name);
  folder = CollectPhotos(root());
  UsePhotosAsFrames(&folder);
  EXPECT_THAT(Paths(folder.photos),
              ElementsAre("frames/a.jpg", "frames/b.jpg", "frames/c2.jpg", "frames/c10.jpg"));
  Write("images/more/a.jpg");
  PhotoFolder two = CollectPhotos(root());
  EXPECT_THROW(UsePhotosAsFrames(&two), Error);
}

TEST_F(PhotoFolderTest, TakesOneCompleteColmapModel) {
  for (const char* name : {"images/a.jpg", "images/b.jpg"}) Write(name);
  for (const char* stem : {"cameras", "images", "points3D"}) {
    Write(std::string("sparse/0/") + stem + ".txt");
    Write(std::string("sparse/0/") + stem + ".bin");
  }
  Write("sparse/0/project.ini");
  EXPECT_THAT(Paths(CollectPhotos(root()).model_files),
              ElementsAre("sparse/0/cameras.bin", "sparse/0/images.bin", "sparse/0/points3D.bin"));
  fs::remove(root() / "sparse/0/images.bin");
  EXPECT_THAT(Paths(CollectPhotos(root()).model_files),
              ElementsAre("sparse/0/cameras.txt", "sparse/0/images.txt", "sparse/0/points3D.txt"));
  // Parts of a model go to the server, which says what is missing.
  fs::remove(root() / "sparse/0/images.txt");
  EXPECT_EQ(CollectPhotos(root()).model_files.size(), 4u);
}

TEST_F(PhotoFolderTest, TakesTimesWithColmapModel) {
  for (const char* name : {"images/a.jpg", "images/b.jpg", "times.txt"}) Write(name);
  PhotoFolder folder = CollectPhotos(root());
  EXPECT_THAT(folder.model_files, IsEmpty());
  EXPECT_THAT(folder.notes, ElementsAre(HasSubstr("give one, or colour the frames")));
  Write("transforms.json", R"({"frames": []})");
  folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.model_files), ElementsAre("transforms.json"));
  EXPECT_THAT(folder.notes, ElementsAre(HasSubstr("have times of their own")));
  for (const char* stem : {"cameras", "images", "points3D"}) {
    Write(std::string("sparse/0/") + stem + ".bin");
  }
  folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.model_files),
              ElementsAre("sparse/0/cameras.bin",
                          "sparse/0/images.bin",
                          "sparse/0/points3D.bin",
                          "times.txt",
                          "transforms.json"));
  EXPECT_THAT(folder.notes, IsEmpty());
}

TEST_F(PhotoFolderTest, TakesSubfoldersThatTransformsNames) {
  for (const char* name : {"train/a.png", "train/b.png", "other/c.png"}) Write(name);
  Write("transforms.json", R"({"frames": [{"file_path": "./train/a"}, {"file_path": "../x/y"}]})");
  const PhotoFolder folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.photos), ElementsAre("train/a.png", "train/b.png"));
  EXPECT_THAT(Paths(folder.model_files), ElementsAre("transforms.json"));
}

TEST_F(PhotoFolderTest, TakesSubfoldersOfRig) {
  for (const char* name : {"images/cam01/0001.jpg", "images/cam02/0001.jpg"}) Write(name);
  Write("transforms.json", R"({"frames": []})");
  EXPECT_THAT(Paths(CollectPhotos(root()).photos),
              ElementsAre("images/cam01/0001.jpg", "images/cam02/0001.jpg"));
  fs::remove_all(root() / "images");
  for (const char* name : {"cam01/0001.jpg", "cam02/0001.jpg", "other/0001.jpg"}) Write(name);
  Write("transforms.json",
        R"({"frames": [{"file_path": "./cam01/0001.jpg"}, {"file_path": "cam02/0001.jpg"}]})");
  EXPECT_THAT(Paths(CollectPhotos(root()).photos), ElementsAre("cam01/0001.jpg", "cam02/0001.jpg"));
}

TEST_F(PhotoFolderTest, FoldersOfFramesAreCameras) {
  for (const char* name : {"right/10.png", "right/9.png", "left/9.png", "notes/a.txt"}) Write(name);
  EXPECT_THAT(ErrorOf(root()), HasSubstr("no photographs"));
  PhotoFolder folder = CollectPhotos(root(), /*as_frames=*/true);
  UsePhotosAsFrames(&folder);
  EXPECT_THAT(Paths(folder.AllFiles()),
              ElementsAre("frames/left/9.png", "frames/right/9.png", "frames/right/10.png"));
  EXPECT_EQ(folder.Layout(), CaptureLayout::kFilms);
  EXPECT_NO_THROW(RequirePhoto(folder, "right/10.png"));
  fs::remove_all(root() / "left");
  EXPECT_THAT(ErrorOf(root(), /*as_frames=*/true), HasSubstr("did you mean"));
}

TEST_F(PhotoFolderTest, TakesPosedFilmsInsteadOfPhotos) {
  for (const char* name : {"cam01.mp4", "cam00.mp4", "poses_bounds.npy", "notes.txt"}) Write(name);
  PhotoFolder folder = CollectPhotos(root());
  EXPECT_THAT(Paths(folder.AllFiles()), ElementsAre("cam00.mp4", "cam01.mp4", "poses_bounds.npy"));
  EXPECT_EQ(folder.Layout(), CaptureLayout::kPosesBounds);
  EXPECT_FALSE(folder.film.has_value());
  EXPECT_NO_THROW(RequirePhoto(folder, "cam00/f000003.png"));
  Write("films/cam02.mp4");
  Write("transforms.json", R"({"frames": [{"file_path": "films/cam02.mp4"}]})");
  EXPECT_THAT(Paths(CollectPhotos(root()).AllFiles()),
              ElementsAre("cam00.mp4", "cam01.mp4", "films/cam02.mp4", "transforms.json"));
  fs::remove(root() / "transforms.json");
  fs::remove(root() / "cam01.mp4");
  EXPECT_TRUE(CollectPhotos(root()).film.has_value());  // one film has no use for poses
}

TEST_F(PhotoFolderTest, TakesNerfiesFolderUnchanged) {
  for (const char* name : {"metadata.json",
                           "dataset.json",
                           "points.npy",
                           "camera/1.json",
                           "camera/2.json",
                           "camera-paths/orbit/1.json",
                           "rgb/1x/1.png",
                           "rgb/1x/2.png",
                           "rgb/2x/1.png",
                           "rgb/2x/2.png"}) {
    Write(name);
  }
  EXPECT_THAT(Paths(CollectPhotos(root()).AllFiles()),
              ElementsAre("rgb/2x/1.png",
                          "rgb/2x/2.png",
                          "camera/1.json",
                          "camera/2.json",
                          "dataset.json",
                          "metadata.json",
                          "points.npy"));
}

TEST_F(PhotoFolderTest, NotesUnusedPosesBesidePhotos) {
  for (const char* name : {"images/a.jpg", "images/b.jpg", "sparse/0/cameras.bin"}) Write(name);
  const PhotoFolder folder = CollectPhotos(root() / "images/");
  EXPECT_THAT(Paths(folder.photos), ElementsAre("a.jpg", "b.jpg"));
  EXPECT_THAT(folder.model_files, IsEmpty());
  ASSERT_EQ(folder.notes.size(), 1u);
  EXPECT_THAT(folder.notes[0], HasSubstr("sparse are not used"));
}

TEST_F(PhotoFolderTest, ErrorsNameFolder) {
  EXPECT_THAT(ErrorOf(root()), HasSubstr("there is no folder"));
  Write("notes.txt"), Write("list.csv");
  EXPECT_THAT(ErrorOf(root()), HasSubstr("; it has list.csv, notes.txt"));
  Write("deep/a.jpg");
  EXPECT_THAT(ErrorOf(root()), HasSubstr("contains no photographs (JPEG, PNG, TIFF, "));
  EXPECT_THAT(ErrorOf(root()), HasSubstr("did you mean"));
  Write("one.jpg");
  EXPECT_THAT(ErrorOf(root()), HasSubstr("one photograph"));
  EXPECT_THAT(ErrorOf(root() / "one.jpg"), HasSubstr("is not a folder"));
  Write("two.jpg");
  EXPECT_EQ(ErrorOf(root()), "");
  Write("transforms.json", "{");
  EXPECT_THAT(ErrorOf(root()), HasSubstr("is not JSON"));
}

TEST_F(PhotoFolderTest, RefusesFilmOfOnePicture) {
  Write("one.jpg");
  EXPECT_THAT(ErrorOf(root(), /*as_frames=*/true),
              HasSubstr("contains one picture (one.jpg), and one frame is not a film"));
}

TEST_F(PhotoFolderTest, RefusesNamesThatAreNotUtf8) {
  for (const char* name : {"a.jpg", "b\xe9.jpg"}) Write(name);
  EXPECT_THAT(ErrorOf(root()), HasSubstr("not UTF-8"));
}

TEST_F(PhotoFolderTest, FindsPhotoOfColoredCopy) {
  for (const char* name : {"images/a.jpg", "images/b.jpg", "images/x/b.jpg"}) Write(name);
  const PhotoFolder folder = CollectPhotos(root());
  EXPECT_EQ(FindPhotoByStem(folder, "/elsewhere/a.png"), "a.jpg");
  EXPECT_EQ(FindPhotoByStem(folder, "b.png"), "");  // two have this stem
  EXPECT_EQ(FindPhotoByStem(folder, "key_view.png"), "");
  EXPECT_NO_THROW(RequirePhoto(folder, "a"));
  EXPECT_NO_THROW(RequirePhoto(folder, "x/b.jpg"));
  EXPECT_THROW(RequirePhoto(folder, "c"), Error);
}

}  // namespace
}  // namespace color3d::client
