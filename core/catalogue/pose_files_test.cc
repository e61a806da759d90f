#include "core/catalogue/pose_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace color3d {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Files = std::vector<std::string>;

Files Model(const std::string& folder, const std::string& ending = ".txt") {
  const std::string prefix = folder.empty() ? "" : folder + "/";
  return {prefix + "cameras" + ending, prefix + "images" + ending, prefix + "points3D" + ending};
}

Files Folders(const Files& files) {
  Files folders;
  for (const ColmapPlace& place : ColmapPlaces(files)) folders.push_back(place.folder);
  return folders;
}

Files operator+(Files x, const Files& y) {
  x.insert(x.end(), y.begin(), y.end());
  return x;
}

TEST(PoseFiles, FindsCompleteModelsInUsualPlaces) {
  EXPECT_THAT(Folders({"a.jpg", "images/b.jpg"}), IsEmpty());
  EXPECT_THAT(Folders(Model("sparse/1")), ElementsAre("sparse/1"));
  EXPECT_THAT(Folders(Model("") + Model("colmap/sparse/0") + Model("sparse") + Model("sparse/1") +
                      Model("sparse/0") + Model("sparse/12")),
              ElementsAre("sparse/0", "sparse/1", "sparse/12", "sparse", "colmap/sparse/0", ""));
  EXPECT_THAT(Folders(Model("dense/0/sparse")), ElementsAre("dense/0/sparse"));
}

TEST(PoseFiles, FallsBackToOtherFolders) {
  EXPECT_THAT(Folders(Model("distorted/sparse/0") + Model("sparse/0")), ElementsAre("sparse/0"));
  EXPECT_THAT(Folders(Model("distorted/sparse/0")), ElementsAre("distorted/sparse/0"));
  EXPECT_THAT(Folders(Model("augment/sparse") + Model("masks/sparse")), IsEmpty());
}

TEST(PoseFiles, UsesOneCompleteFormat) {
  const std::vector<ColmapPlace> both =
      ColmapPlaces(Model("sparse", ".txt") + Model("sparse", ".bin"));
  ASSERT_EQ(both.size(), 1u);
  EXPECT_TRUE(both[0].whole);
  EXPECT_EQ(both[0].files, Model("sparse", ".bin"));
  const std::vector<ColmapPlace> text =
      ColmapPlaces(Model("sparse", ".txt") + Files{"sparse/cameras.bin"});
  EXPECT_EQ(text.at(0).files, Model("sparse", ".txt"));
  const std::vector<ColmapPlace> parts = ColmapPlaces({"sparse/cameras.bin", "sparse/images.txt"});
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_FALSE(parts[0].whole);
  EXPECT_EQ(parts[0].files.size(), 2u);
  EXPECT_THAT(Folders({"images.txt"}), IsEmpty());
  EXPECT_THAT(Folders({"sparse/0/images.txt", "sparse/0/points3D.txt"}), ElementsAre("sparse/0"));
}

TEST(PoseFiles, RecognizesNamesOfTransforms) {
  EXPECT_TRUE(IsTransformsFile("transforms.json"));
  EXPECT_TRUE(IsTransformsFile("a/transforms_val.json"));
  EXPECT_FALSE(IsTransformsFile("my_transforms.json"));
}

}  // namespace
}  // namespace color3d
