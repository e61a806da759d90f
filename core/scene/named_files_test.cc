#include "core/scene/named_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

std::string Found(const std::vector<std::string>& files, const std::string& name) {
  return NamedFiles(files).Find(name);
}

TEST(NamedFiles, PrefersPathThenCaseThenStem) {
  EXPECT_EQ(Found({"images/a.jpg", "a.jpg"}, "a.jpg"), "images/a.jpg");
  EXPECT_EQ(Found({"input/a.jpg"}, "a.jpg"), "input/a.jpg");
  EXPECT_EQ(Found({"images/a.jpg", "images/A.JPG"}, "A.JPG"), "images/A.JPG");
  EXPECT_EQ(Found({"images/a.jpg"}, "A.JPG"), "images/a.jpg");
  EXPECT_EQ(Found({"Images/a.jpg"}, "a.jpg"), "Images/a.jpg");
  for (const char* ending : {".JPEG", ".TIF", ".TIFF", ".PNG", ".tif", ".jpeg"}) {
    const std::string file = std::string("images/a") + ending;
    EXPECT_EQ(Found({file}, "a"), file);
    EXPECT_EQ(Found({file}, "a.jpg"), file);
    EXPECT_EQ(Found({file}, "a.heic"), file);
  }
  EXPECT_EQ(Found({"images/shot.0001.png"}, "shot.0001"), "images/shot.0001.png");
  EXPECT_EQ(Found({"images/a.jpg.png"}, "a.jpg"), "images/a.jpg.png");
}

TEST(NamedFiles, FindsNothingForAmbiguousNames) {
  EXPECT_EQ(Found({"images/a.png", "images/a.tif"}, "a.jpg"), "");
  EXPECT_EQ(Found({"images/a.png", "images/A.PNG"}, "a.PNG"), "");
  EXPECT_EQ(Found({"images/a.png"}, "b.png"), "");
}

TEST(NamedFiles, DropsUnknownFolders) {
  const std::vector<std::string> rig = {"images/left/0.jpg", "images/right/0.jpg"};
  EXPECT_EQ(Found(rig, "images\\left\\0.jpg"), "images/left/0.jpg");
  EXPECT_EQ(Found(rig, "C:\\data\\scene\\images\\right\\0.jpg"), "images/right/0.jpg");
  EXPECT_EQ(Found(rig, "/home/me/images/right/0.JPG"), "images/right/0.jpg");
  EXPECT_EQ(Found(rig, "../images/left/0"), "images/left/0.jpg");
  // Another camera's photo of the same name is another photo.
  EXPECT_EQ(Found(rig, "middle/0.jpg"), "");
  EXPECT_EQ(Found(rig, "0.jpg"), "");
}

TEST(NamedFiles, TwoNamesDoNotShareAFile) {
  const NamedFiles files({"images/a.jpg", "images/b.png"});
  EXPECT_THAT(files.Find(std::vector<std::string>{"A.jpg", "a.jpg", "b.jpg", "c.jpg"}),
              ElementsAre("", "images/a.jpg", "images/b.png", ""));
  EXPECT_THAT(files.Find(std::vector<std::string>{"x/a.jpg", "y/a.jpg"}),
              ElementsAre("images/a.jpg", "images/a.jpg"));
}

TEST(NamedFiles, FindsNothingOutsideOfScene) {
  const ScratchFolder folder;
  const fs::path scene = folder.path() / "scene";
  fs::create_directories(scene / "images");
  for (const fs::path& file : {folder.path() / "secret.png", scene / "augment/x.png"}) {
    fs::create_directories(file.parent_path());
    WriteFileAtomic(file, "x");
  }
  const NamedFiles photos = NamedFiles::Photos(scene);
  EXPECT_EQ(photos.size(), 0u);
  for (const std::string& name : {std::string("../secret.png"),
                                  std::string("images/../../secret.png"),
                                  (folder.path() / "secret.png").string(),
                                  std::string("..\\secret.png"),
                                  std::string("augment/x.png"),
                                  std::string(".."),
                                  std::string("")}) {
    EXPECT_EQ(photos.Find(name), "") << name;
  }
}

TEST(NamedFiles, ViewNamesAreShort) {
  EXPECT_EQ(ViewNameOf("images/l/a.jpg"), "l/a.jpg");
  EXPECT_EQ(ViewNameOf("train/a.jpg"), "train/a.jpg");
  EXPECT_EQ(SummarizeNames({"a", "b"}), "a, b");
  EXPECT_EQ(SummarizeNames({"a", "b", "c", "d"}, 2), "a, b and 2 more");
}

}  // namespace
}  // namespace color3d
