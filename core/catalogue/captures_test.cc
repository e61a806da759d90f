#include "core/catalogue/captures.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

using Files = std::vector<std::string>;

TEST(DetectCaptureTest, ReadsEachLayoutFromFileNames) {
  EXPECT_EQ(DetectCapture({}), CaptureLayout::kPhotos);
  EXPECT_EQ(DetectCapture({"a.jpg", "b.jpg"}), CaptureLayout::kPhotos);
  for (const std::string folder : {"sparse/0/", "colmap/sparse/0/", ""}) {
    const Files files = {
        "images/a.jpg", folder + "cameras.bin", folder + "images.bin", folder + "points3D.bin"};
    EXPECT_EQ(DetectCapture(files), CaptureLayout::kColmap) << folder;
  }
  EXPECT_EQ(DetectCapture({"a.jpg", "transforms.json"}), CaptureLayout::kTransforms);
  EXPECT_EQ(DetectCapture({"train/a.png", "transforms_train.json"}), CaptureLayout::kTransforms);
  EXPECT_EQ(DetectCapture({"rgb/2x/a.png", "metadata.json", "camera/a.json"}),
            CaptureLayout::kNerfies);
  EXPECT_EQ(DetectCapture({"scene.PLY"}), CaptureLayout::kSplat);
  EXPECT_EQ(DetectCapture({"film.mp4"}), CaptureLayout::kFilm);
  EXPECT_EQ(DetectCapture({"frames/1.png", "frames/2.png"}), CaptureLayout::kFilm);
  EXPECT_EQ(DetectCapture({"frames/a/1.png", "frames/b/1.png"}), CaptureLayout::kFilms);
  EXPECT_EQ(DetectCapture({"a.mp4", "b.mp4"}), CaptureLayout::kFilms);
  EXPECT_EQ(DetectCapture({"a.mp4", "b.mp4", "transforms.json"}), CaptureLayout::kTransforms);
  EXPECT_EQ(DetectCapture({"a.mp4", "b.mp4", "poses_bounds.npy"}), CaptureLayout::kPosesBounds);
  EXPECT_EQ(DetectCapture({"images/a.jpg", "poses_bounds.npy"}), CaptureLayout::kPosesBounds);
}

TEST(DetectCaptureTest, IgnoresAugmentFilesAndMasks) {
  EXPECT_EQ(DetectCapture({"film.mp4", "augment/a.png", "masks/a.png"}), CaptureLayout::kFilm);
  EXPECT_EQ(DetectCapture({"a.jpg", "augment/transforms.json"}), CaptureLayout::kPhotos);
  EXPECT_EQ(DetectCapture({"a.jpg", "film.mp4"}), CaptureLayout::kPhotos);
  EXPECT_EQ(DetectCapture({"film.mp4", "masks/film.mp4"}), CaptureLayout::kFilm);
}

TEST(CaptureTablesTest, HaveOneRowForEachValueAndName) {
  std::set<std::string> names;
  for (const CaptureLayoutInfo& info : CaptureLayouts()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_EQ(LayoutOfName(info.name), info.layout);
    EXPECT_STREQ(InfoOf(info.layout).name, info.name);
  }
  EXPECT_EQ(LayoutOfName("other"), CaptureLayout::kUnknown);
  names.clear();
  for (const CaptureKindInfo& info : CaptureKinds()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_EQ(KindOfName(info.name), info.kind);
    EXPECT_STREQ(InfoOf(info.kind).name, info.name);
  }
  EXPECT_THROW(KindOfName("other"), Error);
}

TEST(CaptureKindsTest, FilmsLeaveOutTheStagesOfReconstruction) {
  const std::set<std::string> idle = {
      kind::kReconstructGeometry, kind::kSolveChroma, kind::kExport};
  for (const Stage& stage : StageCatalogue()) {
    EXPECT_EQ(!WhyNothingToDo(CaptureKind::kFilm, stage.kind).empty(), idle.contains(stage.kind))
        << stage.kind;
    EXPECT_EQ(!WhyNothingToDo(CaptureKind::kPictures, stage.kind).empty(),
              idle.contains(stage.kind))
        << stage.kind;
    EXPECT_EQ(WhyNothingToDo(CaptureKind::kStatic, stage.kind), "") << stage.kind;
    EXPECT_EQ(WhyNothingToDo(CaptureKind::kDynamic, stage.kind), "") << stage.kind;
    EXPECT_EQ(WhyNothingToDo(CaptureKind::kRelief, stage.kind), "") << stage.kind;
  }
}

}  // namespace
}  // namespace color3d
