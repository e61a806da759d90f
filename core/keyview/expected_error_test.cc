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

// Six views around something: each shows its own samples and, of its neighbours', half.
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

TEST(KeyViews, SeveralCoverARingTogether) {
  const ChosenKeyViews two = ChooseKeyViews(Ring(), {}, kAll, 2);
  EXPECT_THAT(two.views, ElementsAre(0, testing::AnyOf(2, 3, 4)));
  EXPECT_LT(two.error[1], two.error[0]);
  const ChosenKeyViews three = ChooseKeyViews(Ring(), {}, kAll, 3, /*first=*/1);
  EXPECT_EQ(three.views[0], 1) << "as given";
  std::vector<int> sorted = three.views;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_THAT(sorted, ElementsAre(1, 3, 5)) << "every view is shown";
  EXPECT_NEAR(three.error[2], kErrorSeen, 1e-9);
}

TEST(KeyViews, StrangeViewsAreWorthMoreThanPlaces) {
  // Nothing is known of places; view 5 looks like nothing else.
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

TEST(KeyViews, WhatMayNotBeChosenIsNotAndTooManyAreRefused) {
  std::vector<bool> allowed = kAll;
  allowed[0] = allowed[3] = false;
  const ChosenKeyViews four = ChooseKeyViews(Ring(), {}, allowed, 4);
  EXPECT_THAT(four.views, testing::UnorderedElementsAre(1, 2, 4, 5));
  try {
    ChooseKeyViews(Ring(), {}, allowed, 5);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("5 key views are asked for, but only 4"));
  }
}

TEST(KeyViews, EachFurtherOneIsExpectedToSaveSomething) {
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

TEST(NextKeyView, SavesWhereErrorsAreNotWhereMostIsSeen) {
  // View 1 shows more of the others, but what it shows is right already.
  SeenSamples seen(4, 4);
  for (int s = 0; s < 4; ++s) seen.SetSeen(1, 0, s);
  for (int s = 0; s < 2; ++s) seen.SetSeen(2, 3, s);
  std::vector<std::vector<float>> errors(4, std::vector<float>(4, kErrorSeen));
  errors[3].assign(4, kErrorGuessed);
  errors[1].assign(4, 0.0f);
  errors[2].assign(4, 0.0f);
  const auto next = NextKeyView(seen, errors, {1, 2});
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->view, 2);
  EXPECT_NEAR(next->error_now, (4 * kErrorSeen + 4 * kErrorGuessed) / 16.0, 1e-6);
  EXPECT_NEAR(next->error_now - next->error_with, 2 * (kErrorGuessed - kErrorSeen) / 16.0, 1e-6);
  EXPECT_FALSE(NextKeyView(seen, errors, {}).has_value());
  EXPECT_FALSE(NextKeyView(seen, errors, {1}).has_value()) << "it would save nothing";
}

}  // namespace
}  // namespace color3d
