#include "core/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

TEST(Scene, HoldsOutAndFindsViews) {
  Scene scene = ArcScene(5);
  scene.views[0].held_out = true;
  EXPECT_EQ(scene.HeldOutViews(), std::vector<int>({0}));
  EXPECT_EQ(scene.TrainingViews(), std::vector<int>({1, 2, 3, 4}));
  EXPECT_EQ(scene.FindView("0003.png"), 2);
  EXPECT_EQ(scene.FindView("0003"), 2);
  EXPECT_EQ(scene.FindView("0003.jpg"), 2);
  EXPECT_THAT(Refusal([&] { scene.FindView("fern"); }),
              HasSubstr("no view named fern; it has 0001.png, 0002.png, 0003.png, ..."));
  scene.views[1].name = "0003.jpg";  // two of one stem: only the full name will do
  EXPECT_EQ(scene.FindView("0003.jpg"), 1);
  EXPECT_THROW(scene.FindView("0003"), Error);
  EXPECT_THROW(Scene().FindView("a"), Error);
}

TEST(Scene, ExtentUsesTrainingCameras) {
  Scene scene = ArcScene(3);
  for (int i = 0; i < 3; ++i) {
    scene.views[i].cam_from_world = {};
    scene.views[i].cam_from_world.translation = Eigen::Vector3d(i == 2 ? 1000.0 : -2.0 * i, 0, 0);
  }
  scene.views[2].held_out = true;
  EXPECT_NEAR(scene.Extent(), 1.1, 1e-12);
  scene.views[1].held_out = true;
  EXPECT_EQ(scene.Extent(), 1.0);
  EXPECT_EQ(Scene().Extent(), 1.0);
}

TEST(Scene, FramesOfOnePoseAreFilmOrRelief) {
  Scene scene = ArcScene(3);
  for (View& view : scene.views) {
    view.cam_from_world = {};
    view.moment = Moment{0.1, 0};
  }
  EXPECT_FALSE(scene.capture().is_reconstructed);
  EXPECT_FALSE(scene.capture().is_dynamic);
  scene.relief = Relief{0.3, 0.5, 4.0};
  const std::string text = SceneToJson(scene);
  const Scene again = SceneFromJson(text);
  EXPECT_EQ(again.relief, scene.relief);
  EXPECT_TRUE(again.capture().is_reconstructed);
  EXPECT_TRUE(again.capture().is_dynamic);
  std::string wrong = text;
  wrong.replace(wrong.find("\"horizon\":0.3"), 13, "\"horizon\":0.6");
  EXPECT_THAT(Refusal([&] { SceneFromJson(wrong); }),
              HasSubstr("relief.horizon must be less than relief.foot"));
}

TEST(Scene, JsonKeepsEveryBit) {
  Scene scene = ArcScene(4, {Distortion::Model::kBrown, {-0.1, 0.01, 1e-3, 2e-3}});
  scene.views[2].held_out = true;
  scene.views[3].distortion = {Distortion::Model::kFisheye, {0.1}};
  scene.world_offset = {1.0 / 3.0, 5e6, -1e-9};
  scene.points[4].views = {1, 3};
  const std::string text = SceneToJson(scene);
  const Scene again = SceneFromJson(text);
  EXPECT_EQ(SceneToJson(again), text);
  ASSERT_EQ(again.views.size(), 4u);
  EXPECT_EQ(again.views[2].cam_from_world.rotation.coeffs(),
            scene.views[2].cam_from_world.rotation.coeffs());
  EXPECT_EQ(again.points[4].position, scene.points[4].position);
  EXPECT_EQ(again.points[4].views, std::vector<int>({1, 3}));
  EXPECT_EQ(again.world_offset, scene.world_offset);
  EXPECT_TRUE(again.views[2].held_out);
  EXPECT_EQ(again.views[3].distortion.model, Distortion::Model::kFisheye);
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Scene, NamesFieldOfBrokenJson) {
  const std::string good = SceneToJson(ArcScene(3));
  EXPECT_EQ(Refusal([&] { SceneFromJson(good); }), "");
  const auto said = [&](const std::string& from, const std::string& to) {
    return Refusal([&] { SceneFromJson(Replaced(good, from, to)); });
  };
  EXPECT_THAT(said("\"fx\":50.0", "\"fx\":-50.0"),
              HasSubstr("views[0].camera.fx must be positive"));
  EXPECT_THAT(said("\"fx\":50.0", "\"fx\":null"), HasSubstr("camera.fx must be a number"));
  EXPECT_THAT(said("\"fx\":50.0", "\"fx\":1e999"), HasSubstr("not JSON"));
  EXPECT_THAT(said("\"width\":48", "\"width\":18446744073709551615"), HasSubstr("width"));
  EXPECT_THAT(said("\"width\":48", "\"width\":0"), HasSubstr("width must be 1..1000000, not 0"));
  EXPECT_THAT(said("images/0001.png", "../../etc/passwd"),
              HasSubstr("image_file must be a relative"));
  EXPECT_THAT(said("\"0002.png\"", "\"0001.png\""), HasSubstr("views[1].name must be unique"));
  EXPECT_THAT(said("[0,1,2]", "[0,1,7]"), HasSubstr("points[0]"));
  EXPECT_THAT(said("[0,1,2]", "[2,1,0]"), HasSubstr("ascending"));
  EXPECT_THAT(said("\"version\":1", "\"version\":9"), HasSubstr("version must be 1"));
  EXPECT_THAT(said("color3d.scene", "other"), HasSubstr("format"));
  EXPECT_THAT(said("\"held_out\":false", "\"held_out\":3"), HasSubstr("held_out"));
  EXPECT_THAT(said("\"rotation_wxyz\":[", "\"rotation_wxyz\":[7,"), HasSubstr("4 numbers"));
  EXPECT_THAT(Refusal([] { SceneFromJson("[]"); }), HasSubstr("object"));
  EXPECT_THAT(Refusal([] { SceneFromJson("{}"); }), HasSubstr("format is missing"));
  for (size_t length = 0; length < good.size(); length += 97) {
    EXPECT_NE(Refusal([&] { SceneFromJson(good.substr(0, length)); }), "") << length;
  }
}

TEST(Scene, OldFilesHaveScaleOne) {
  Scene scene = ArcScene(3);
  scene.world_from_scene_scale = 2.5;
  std::string text = SceneToJson(scene);
  EXPECT_EQ(SceneFromJson(text).world_from_scene_scale, 2.5);
  const std::string field = "\"world_from_scene_scale\":2.5,";
  ASSERT_NE(text.find(field), std::string::npos) << text.substr(0, 400);
  EXPECT_EQ(
      SceneFromJson(std::string(text).erase(text.find(field), field.size())).world_from_scene_scale,
      1.0);
  text.replace(text.find(field), field.size(), "\"world_from_scene_scale\":0,");
  EXPECT_THAT(Refusal([&] { SceneFromJson(text); }), HasSubstr("must be positive"));
}

TEST(Scene, JsonHasUnplacedPhotos) {
  Scene scene = ArcScene(3);
  scene.unplaced = {scene.views[2]};
  scene.unplaced[0].name = scene.unplaced[0].image_file = "elsewhere.png";
  const Scene read = SceneFromJson(SceneToJson(scene));
  EXPECT_EQ(read.views.size(), 3u);
  ASSERT_EQ(read.unplaced.size(), 1u);
  EXPECT_EQ(read.unplaced[0].image_file, "elsewhere.png");
  EXPECT_EQ(read.kind(), CaptureKind::kStatic);
  scene.unplaced[0].name = scene.views[0].name;
  EXPECT_THAT(Refusal([&] { SceneFromJson(SceneToJson(scene)); }), HasSubstr("unplaced"));
}

TEST(Scene, JsonHasKindAndOlderFilesOpenWithoutIt) {
  Scene photos = ArcScene(3), dynamic = photos;
  for (View& view : dynamic.views) view.moment = Moment{0.1, 0};
  Scene film = dynamic;
  for (View& view : film.views) view.cam_from_world = {};
  Scene relief = film;
  relief.relief = Relief{0.3, 0.5, 4.0};
  Scene pictures = photos;
  for (View& view : pictures.views) view.cam_from_world = {};
  pictures.are_pictures = true;
  EXPECT_EQ(SceneFromJson(SceneToJson(pictures)).kind(), CaptureKind::kPictures);
  EXPECT_FALSE(pictures.capture().is_reconstructed);
  const std::pair<Scene, CaptureKind> cases[] = {{photos, CaptureKind::kStatic},
                                                 {dynamic, CaptureKind::kDynamic},
                                                 {film, CaptureKind::kFilm},
                                                 {relief, CaptureKind::kRelief}};
  for (const auto& [scene, kind] : cases) {
    EXPECT_EQ(scene.kind(), kind);
    const std::string text = SceneToJson(scene);
    const std::string field = std::string("\"kind\":\"") + InfoOf(kind).name + "\",";
    const size_t at = text.find(field);
    ASSERT_NE(at, std::string::npos) << text.substr(0, 200);
    EXPECT_EQ(SceneFromJson(text).kind(), kind);
    EXPECT_EQ(SceneFromJson(std::string(text).erase(at, field.size())).kind(), kind);
    for (const CaptureKindInfo& other : CaptureKinds()) {
      if (other.kind == kind) continue;
      const std::string wrong = std::string("\"kind\":\"") + other.name + "\",";
      const std::string changed = std::string(text).replace(at, field.size(), wrong);
      EXPECT_THAT(Refusal([&] { SceneFromJson(changed); }), HasSubstr("kind")) << other.name;
    }
    const std::string unknown = std::string(text).replace(at, field.size(), "\"kind\":\"rig\",");
    EXPECT_THAT(Refusal([&] { SceneFromJson(unknown); }), HasSubstr("no kind of scene 'rig'"));
  }
}

// As an earlier version wrote it: a film with a relief, without the kind.
TEST(Scene, ReadsJsonOfEarlierVersion) {
  const std::string view =
      R"("camera":{"cx":4.0,"cy":3.0,"fx":9.0,"fy":9.0,"height":6,"width":8},)"
      R"("cam_from_world":{"rotation_wxyz":[1.0,0.0,0.0,0.0],"translation":[0.0,0.0,0.0]},)"
      R"("captured_camera":{"cx":4.0,"cy":3.0,"fx":9.0,"fy":9.0,"height":6,"width":8},)"
      R"("distortion":{"k":[0.1,0.0,0.0,0.0,0.0,0.0,0.0,0.0],"model":"brown"},)";
  const Scene scene = SceneFromJson(
      R"({"format":"color3d.scene","points":[[0.0,0.5,2.0,0.25,[0,1]]],)"
      R"("relief":{"backdrop_depth":4.0,"foot":0.5,"horizon":0.3},"version":1,"views":[{)" +
      view +
      R"("held_out":false,"image_file":"images/0001.png","mask_file":"masks/0001.png",)"
      R"("moment":{"shot":0,"time_s":0.0},"name":"0001.png"},{)" +
      view +
      R"("held_out":true,"image_file":"images/0002.png",)"
      R"("moment":{"shot":0,"time_s":0.04},"name":"0002.png"}],)"
      R"("world_from_scene_scale":1.0,"world_offset":[0.0,0.0,1.0]})");
  EXPECT_EQ(scene.kind(), CaptureKind::kRelief);
  ASSERT_EQ(scene.views.size(), 2u);
  EXPECT_EQ(scene.views[0].mask_file, "masks/0001.png");
  EXPECT_EQ(scene.views[0].distortion.model, Distortion::Model::kBrown);
  EXPECT_TRUE(scene.views[1].held_out);
  EXPECT_EQ(scene.views[1].moment->time_s, 0.04);
  EXPECT_EQ(scene.points.at(0).views, (std::vector<int>{0, 1}));
  EXPECT_EQ(scene.world_offset.z(), 1.0);
}

}  // namespace
}  // namespace color3d
