#include "core/keyview/expected_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<bool> kAll(6, true);

// Six views around an object: each shows its own samples and half of those of its neighbours.
SeenSamples Ring() {
  SeenSamples seen(6, 8);
  for (int view = 0; view < 6; ++view) {
    for (int s = 0; s < 8; ++s) {
      seen.SetSeen(view, view, s);
      seen.SetSeen((view + (s < 4 ? 1 : 5)) % 6, view, s);
    }
  }
  return seen;
}

TEST(ChooseKeyViewsTest, SpreadsOverRingOfCameras) {
  const ChosenKeyViews two = ChooseKeyViews(Ring(), {}, kAll, 2);
  EXPECT_THAT(two.views, ElementsAre(0, testing::AnyOf(2, 3, 4)));
  EXPECT_LT(two.error[1], two.error[0]);
  const ChosenKeyViews three = ChooseKeyViews(Ring(), {}, kAll, 3, /*first=*/1);
  EXPECT_EQ(three.views[0], 1) << "as given";
  std::vector<int> sorted = three.views;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_THAT(sorted, ElementsAre(1, 3, 5)) << "all samples of every view are visible";
  EXPECT_NEAR(three.error[2], kErrorSeen, 1e-9);
}

TEST(ChooseKeyViewsTest, PrefersViewsWithUnusualContent) {
  // Without positions; view 5 differs from all others.
  NearestDistances distances;
  for (int view = 0; view < 6; ++view) {
    distances.owner.push_back(view);
    distances.weight.push_back(1.0);
    distances.from.emplace_back();
    for (int q = 0; q < 6; ++q) {
      const bool strange = (view == 5) != (q == 5);
      distances.from[view].push_back(view == q ? 0.0f : strange ? 2.0f : 0.5f);
    }
  }
  const ChosenKeyViews chosen = ChooseKeyViews(SeenSamples(6, 0), distances, kAll, 2);
  EXPECT_THAT(chosen.views, testing::UnorderedElementsAre(5, testing::Lt(5)));
}

TEST(ChooseKeyViewsTest, RespectsAllowedViews) {
  std::vector<bool> allowed = kAll;
  allowed[0] = allowed[3] = false;
  const ChosenKeyViews four = ChooseKeyViews(Ring(), {}, allowed, 4);
  EXPECT_THAT(four.views, testing::UnorderedElementsAre(1, 2, 4, 5));
  try {
    ChooseKeyViews(Ring(), {}, allowed, 5);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("5 key views were requested, but only 4"));
  }
}

TEST(ChooseKeyViewsTest, LowersExpectedErrorWithEachView) {
  Random random(5);
  SeenSamples seen(12, 16);
  for (int by = 0; by < 12; ++by) {
    for (int view = 0; view < 12; ++view) {
      for (int s = 0; s < 16; ++s) {
        if (by == view || random.NextUniform() < 0.3) seen.SetSeen(by, view, s);
      }
    }
  }
  const ChosenKeyViews chosen = ChooseKeyViews(seen, {}, std::vector<bool>(12, true), 6);
  for (size_t i = 1; i < chosen.error.size(); ++i) EXPECT_LT(chosen.error[i], chosen.error[i - 1]);
}

TEST(NextKeyViewTest, ReturnsBestOtherView) {
  const auto next = NextKeyView(Ring(), {}, {0});
  ASSERT_TRUE(next.has_value());
  EXPECT_THAT(next->view, testing::AnyOf(2, 3, 4)) << "not a neighbour";
  EXPECT_NEAR(next->error_now, ExpectedError(Ring(), {}, {0}), 1e-9);
  EXPECT_NEAR(next->error_with, ExpectedError(Ring(), {}, {0, next->view}), 1e-9);
  EXPECT_FALSE(NextKeyView(Ring(), {}, {0, 2, 4}).has_value()) << "all samples are visible";
  EXPECT_FALSE(NextKeyView(SeenSamples(1, 0), {}, {0}).has_value());
}

}  // namespace
}  // namespace color3d
