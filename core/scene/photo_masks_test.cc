#include "core/scene/photo_masks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/scene/import/import.h"
#include "core/scene/masks/masked_points.h"
#include "core/scene/sfm/sfm_photos.h"
#include "core/scene/view_images.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A mask that ignores columns first..last.
Image Stripe(int width, int height, int first, int last) {
  Image mask(width, height, 1, 1.0f);
  for (int y = 0; y < height; ++y) {
    for (int x = first; x <= last; ++x) mask.At(0, y, x) = 0.0f;
  }
  return mask;
}

class PhotoMasksTest : public ::testing::Test {
 protected:
  void Write(const std::string& file, const std::string& bytes) {
    fs::create_directories((root() / file).parent_path());
    WriteFileAtomic(root() / file, bytes);
  }
  fs::path root() const { return scratch_.path(); }
  std::string ErrorOf(const std::function<void()>& work) {
    try {
      work();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
      return e.what();
    }
    return "";
  }
  const ScratchFolder scratch_;
};

TEST_F(PhotoMasksTest, FindsEitherNameAndAlpha) {
  const std::string photo = EncodePng8(Image(8, 6, 3, 0.5f));
  for (const char* name : {"images/a.png", "images/s/b.png", "images/c.png"}) Write(name, photo);
  Image clear(8, 6, 4, 1.0f);
  Write("images/opaque.png", EncodePng8(clear));
  clear.At(3, 2, 1) = 0.2f;
  Write("images/clear.png", EncodePng8(clear));
  Write("images/both.png", EncodePng8(clear));
  const std::string mask = EncodePng8(Stripe(8, 6, 0, 3));
  for (const char* name : {"masks/a.png", "masks/s/b.png.png", "masks/both.png"}) Write(name, mask);
  EXPECT_THAT(
      FindMasks(root(),
                {"images/a.png",
                 "images/s/b.png",
                 "images/c.png",
                 "images/opaque.png",
                 "images/clear.png",
                 "images/both.png"},
                {}),
      ElementsAre(
          "masks/a.png", "masks/s/b.png.png", "", "", "images/clear.png", "masks/both.png"));
  const Image alpha = ReadMask(root(), "images/clear.png", "images/clear.png", 8, 6);
  EXPECT_EQ(alpha.At(0, 2, 1), 0.0f);
  EXPECT_EQ(alpha.At(0, 2, 2), 1.0f);
}

TEST_F(PhotoMasksTest, NamesBadMasks) {
  Write("images/a.jpg", EncodeJpeg(Image(8, 6, 3, 0.5f)));
  const auto find = [&] { FindMasks(root(), {"images/a.jpg"}, {"images/unposed.jpg"}); };
  Write("masks/b.png", "");
  EXPECT_THAT(ErrorOf(find), AllOf(HasSubstr("masks/b.png"), HasSubstr("matches no photo")));
  fs::remove(root() / "masks/b.png");
  Write("masks/unposed.png", "");
  EXPECT_EQ(ErrorOf(find), "") << "photos without a pose may have masks";
  Write("masks/notes.txt", "");
  EXPECT_THAT(ErrorOf(find), AllOf(HasSubstr("masks/notes.txt"), HasSubstr("no picture")));

  const auto read = [&] { ReadMask(root(), "masks/a.png", "images/a.jpg", 8, 6); };
  Write("masks/a.png", EncodePng8(Stripe(6, 8, 0, 1)));
  EXPECT_THAT(ErrorOf(read),
              AllOf(HasSubstr("masks/a.png"), HasSubstr("6 x 8 px"), HasSubstr("8 x 6 px")));
  Write("masks/a.png", EncodePng8(Image(8, 6, 1, 0.4f)));
  EXPECT_THAT(ErrorOf(read),
              AllOf(HasSubstr("masks/a.png"), HasSubstr("masks out the whole photo")));
  Write("masks/a.png", "garbage");
  EXPECT_THAT(ErrorOf(read), HasSubstr("masks/a.png"));
}

TEST_F(PhotoMasksTest, LeavesOutMasksOfDeletedPhotosWithNote) {
  Write("images/a.jpg", EncodeJpeg(Image(8, 6, 3, 0.5f)));
  Write("masks/A.PNG", EncodePng8(Stripe(8, 6, 0, 3)));
  Write("masks/gone.jpg.png", EncodePng8(Stripe(8, 6, 0, 3)));
  std::vector<std::string> warnings;
  EXPECT_THAT(FindMasks(root(), {"images/a.jpg"}, {}, &warnings), ElementsAre("masks/A.PNG"));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0],
              HasSubstr("1 of 2 masks match no photo and were left out: masks/gone.jpg.png"));
}

TEST_F(PhotoMasksTest, ReducedPixelNeedsFullCoverage) {
  const Image mask = ResizeMask(Stripe(8, 4, 0, 2), 4, 2);
  EXPECT_THAT(mask.data, ElementsAre(0, 0, 1, 1, 0, 0, 1, 1));
}

TEST_F(PhotoMasksTest, FollowSceneAndLens) {
  const Scene scene = ArcScene(4);
  WritePhotos(scene, root());
  WriteColmapText(scene, root() / "sparse/0");
  const Camera& camera = scene.views[1].captured_camera;
  const std::string name = fs::path(scene.views[1].name).replace_extension(".png").string();
  Write("masks/" + name, EncodePng8(Stripe(camera.width, camera.height, 0, camera.width / 2 - 1)));
  QuietRun run(1);
  const ScratchFolder scratch;
  const ImportResult result = ImportScene(root(), scratch.path(), {}, run.control());
  EXPECT_EQ(result.masked_views, 1);
  const Scene again = SceneFromJson(SceneToJson(result.scene));
  EXPECT_EQ(again.views[0].mask_file, "");
  EXPECT_EQ(again.views[1].mask_file, "masks/" + name);

  const ViewImages images(again, root(), 40);
  EXPECT_EQ(images.Mask(0), nullptr);
  const auto mask = images.Mask(1);
  const Camera working = images.WorkingCamera(1);
  ASSERT_EQ(mask->width, working.width);
  EXPECT_EQ(mask->At(0, 5, working.width / 2 - 2), 0.0f);
  EXPECT_EQ(mask->At(0, 5, working.width / 2 + 1), 1.0f);
  EXPECT_EQ(images.Mask(1), mask) << "cached";

  // Points lose their observations in the masked half and are dropped if too few remain.
  Scene pointed = again;
  pointed.points.clear();
  const Pose& pose = again.views[1].cam_from_world;
  for (const double x : {0.25, 0.75}) {
    const Eigen::Vector3d ray = working.Ray(x * working.width, 0.5 * working.height);
    SparsePoint point;
    point.position = pose.WorldFromCamera(2.0 * ray);
    point.views = {1, 2};
    pointed.points.push_back(point);
    point.views = {0, 1, 2};
    pointed.points.push_back(point);
    point.views = {};
    pointed.points.push_back(point);
  }
  const std::vector<SparsePoint> kept = UnmaskedPoints(pointed, images);
  ASSERT_EQ(kept.size(), 5u);
  EXPECT_THAT(kept[0].views, ElementsAre(0, 2));
  EXPECT_THAT(kept[1].views, ElementsAre());
  EXPECT_THAT(kept[2].views, ElementsAre(1, 2));
}

TEST_F(PhotoMasksTest, StructureFromMotionGetsMasksOfCopiesSize) {
  Write("images/a.png", EncodePng8(Image(80, 60, 1, 0.5f)));
  Write("images/b.png", EncodePng8(Image(80, 60, 1, 0.5f)));
  Write("masks/b.png", EncodePng8(Stripe(80, 60, 0, 39)));
  std::vector<Photo> photos = ListPhotos(root());
  for (Photo& photo : photos) ProbePhoto(root(), &photo);
  photos[1].mask_file = "masks/b.png";
  QuietRun run(1);
  const ScratchFolder out;
  const FeatureImages written = WriteFeatureImages(
      photos, root(), out.path() / "copies", out.path() / "masks", 40, 0, run.control());
  EXPECT_TRUE(written.masked);
  EXPECT_FALSE(fs::exists(out.path() / "masks" / (written.names[0] + ".png")));
  const Image mask = ReadImage(out.path() / "masks" / (written.names[1] + ".png"));
  ASSERT_EQ(mask.width, 40);
  EXPECT_EQ(mask.At(0, 9, 18), 0.0f);
  EXPECT_EQ(mask.At(0, 9, 20), 1.0f);
}

TEST_F(PhotoMasksTest, MaskedFeaturesConnectNoPhotos) {
  Image photo(320, 240, 1, 0.4f);  // squares of different sizes all over
  for (int i = 0; i < 40; ++i) {
    const int size = 5 + i % 7, left = 20 + 36 * (i % 8), top = 20 + 44 * (i / 8);
    for (int y = top; y < top + size; ++y) {
      for (int x = left; x < left + size; ++x) photo.At(0, y, x) = 0.9f;
    }
  }
  for (const char* name : {"images/a.png", "images/b.png"}) Write(name, EncodePng8(photo));
  Write("masks/b.png", EncodePng8(Stripe(320, 240, 0, 159)));
  std::vector<Photo> photos = ListPhotos(root());
  for (Photo& p : photos) ProbePhoto(root(), &p);
  photos[1].mask_file = "masks/b.png";
  QuietRun run(1);
  const ScratchFolder out;
  const FeatureImages written = WriteFeatureImages(
      photos, root(), out.path() / "copies", out.path() / "masks", 320, 100, run.control());
  const LocalFeatures &all = written.features[0], &half = written.features[1];
  ASSERT_GT(all.count(), 20);
  EXPECT_GT(half.count(), all.count() / 4);
  EXPECT_LT(half.count(), 3 * all.count() / 4);
  for (int i = 0; i < half.count(); ++i) EXPECT_GE(half.positions[2 * i], -1.0f);
}

}  // namespace
}  // namespace color3d
