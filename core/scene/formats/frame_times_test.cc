#include "core/scene/formats/frame_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/formats/scene_readers.h"
#include "core/scene/import.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::vector<View> Views(const std::vector<std::string>& names) {
  std::vector<View> views(names.size());
  for (size_t i = 0; i < names.size(); ++i) views[i].name = names[i];
  return views;
}

std::string Refused(const std::vector<FrameTime>& times, std::vector<View> views) {
  return Refusal([&] { SetMoments(times, "cameras.json", &views); });
}

TEST(FrameTimesTest, TimesCountFromTheFirstAndMayBeInAnyOrder) {
  std::vector<View> views = Views({"a", "b", "c"});
  SetMoments({{7.5, ""}, {5.0, ""}, {6.0, ""}}, "cameras.json", &views);
  EXPECT_EQ(views[0].moment, (Moment{2.5, 0}));
  EXPECT_EQ(views[1].moment, (Moment{0.0, 0}));
  EXPECT_EQ(views[2].moment, (Moment{1.0, 0}));
}

TEST(FrameTimesTest, WithoutTimesNothingHasAMoment) {
  std::vector<View> views = Views({"a", "b"});
  SetMoments({{std::nullopt, ""}, {std::nullopt, ""}}, "cameras.json", &views);
  EXPECT_FALSE(views[0].moment || views[1].moment);
}

TEST(FrameTimesTest, CamerasAreNamedOrAreTheFoldersOfFramesOfOneTime) {
  const std::vector<FrameTime> named = {{0.0, "right"}, {1.0, "right"}, {0.0, "left"}};
  std::vector<View> views = Views({"a", "b", "c"});
  SetMoments(named, "cameras.json", &views);
  EXPECT_EQ(views[0].moment->shot, views[1].moment->shot);
  EXPECT_NE(views[0].moment->shot, views[2].moment->shot);
  views = Views({"cam1/0", "cam1/1", "cam2/0"});
  SetMoments({{0.0, ""}, {1.0, ""}, {0.0, ""}}, "cameras.json", &views);
  EXPECT_EQ(views[0].moment->shot, views[1].moment->shot);
  EXPECT_NE(views[0].moment->shot, views[2].moment->shot);
}

TEST(FrameTimesTest, WhatDoesNotFitIsNamed) {
  EXPECT_THAT(Refused({{0.0, ""}, {std::nullopt, ""}}, Views({"a", "b"})),
              AllOf(HasSubstr("b has no time"), HasSubstr("cameras.json")));
  EXPECT_THAT(Refused({{0.0, "left"}, {1.0, ""}}, Views({"a", "b"})), HasSubstr("b has no camera"));
  EXPECT_THAT(Refused({{2.0, ""}, {2.0, ""}}, Views({"a", "b"})),
              AllOf(HasSubstr("a and b"), HasSubstr("one time (2)")));
}

TEST(FrameTimesTest, EveryEighthMomentIsHeldOutOfAllCameras) {
  Scene scene = ArcScene(2, {});
  const std::vector<View> cameras = scene.views;
  scene.views.clear();
  for (int i = 0; i < 12; ++i) {
    for (int c = 0; c < 2; ++c) {
      scene.views.push_back(cameras[c]);
      scene.views.back().moment = Moment{0.1 * i, c};
    }
  }
  ASSERT_TRUE(scene.IsDynamic());
  EXPECT_FALSE(scene.IsFilm());
  std::vector<std::string> warnings;
  HoldOutEveryEighth(&scene, &warnings);
  EXPECT_THAT(scene.HeldOutViews(), testing::ElementsAre(8, 9));
  EXPECT_TRUE(warnings.empty());
}

}  // namespace
}  // namespace color3d
