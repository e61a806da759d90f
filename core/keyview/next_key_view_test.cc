#include "core/keyview/next_key_view.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(NextKeyView, AddsTheMostOfWhatIsNotShown) {
  Scene scene;
  scene.views.resize(4);
  scene.views[3].held_out = true;
  for (const std::vector<int>& views :
       {std::vector<int>{0, 1}, {1, 2}, {1, 2}, {2, 3}, {2, 3}, {3}}) {
    SparsePoint point;
    point.views = views;
    scene.points.push_back(point);
  }
  const auto next = NextKeyView(scene, {0});
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->view, 2);
  EXPECT_NEAR(next->covered_now, 2.0 / 11.0, 1e-9);
  EXPECT_NEAR(next->covered_with, 10.0 / 11.0, 1e-9);
  EXPECT_FALSE(NextKeyView(scene, {0, 1, 2, 3}).has_value());
  EXPECT_FALSE(NextKeyView(Scene{}, {}).has_value());
}

}  // namespace
}  // namespace color3d
