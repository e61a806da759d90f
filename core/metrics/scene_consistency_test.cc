#include "core/metrics/scene_consistency.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/color/lab.h"
#include "core/color/lab_planes.h"

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 64;

Image TrueLab() {
  Image lab(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      lab.At(0, y, x) =
          static_cast<float>(50.0 + 15.0 * std::sin(0.31 * x + 0.17 * y) * std::cos(0.23 * y));
      lab.At(1, y, x) = static_cast<float>(15.0 * std::sin(0.1 * x));
      lab.At(2, y, x) = static_cast<float>(15.0 * std::cos(0.1 * y));
    }
  }
  return lab;
}

// Two views from one place, so that all pixels match; `depth` differs between methods.
class SceneConsistencyTest : public ::testing::Test {
 protected:
  // `swapped_view`: its a and b are exchanged, or -1.
  SceneConsistency Measure(float depth, int swapped_view) const {
    ConsistencySource source;
    source.groups = {2};
    source.render = [&](int view) {
      const Camera camera{kWidth, kHeight, 80.0, 80.0, kWidth / 2.0, kHeight / 2.0};
      Image map(kWidth, kHeight, 1, depth);
      for (int y = 0; y < kHeight / 2; ++y) {
        for (int x = 0; x < kWidth; ++x) map.At(0, y, x) = view == 0 ? depth : 1.0f;
      }
      return ConsistencySource::Rendered{{camera, Pose(), map}, Colored(view, swapped_view)};
    };
    source.colored_lab = [&](int view) { return Colored(view, swapped_view); };
    source.has_truth = [&](int view) { return view < views_with_truth_; };
    source.true_srgb = [&](int) { return SrgbFromLab(TrueLab()); };
    ThreadPool pool(2);
    return MeasureConsistency(source, pool, CancellationToken());
  }

  static Image Colored(int view, int swapped_view) {
    const Image lab = TrueLab();
    if (view != swapped_view) return lab;
    Image swapped = lab;
    for (size_t i = 0; i < lab.PlaneSize(); ++i) {
      swapped.Plane(1)[i] = lab.Plane(2)[i];
      swapped.Plane(2)[i] = lab.Plane(1)[i];
    }
    return swapped;
  }

  int views_with_truth_ = 2;
};

TEST_F(SceneConsistencyTest, CommonMatchesDoNotDependOnGeometry) {
  const SceneConsistency right = Measure(1.0f, 1), wrong = Measure(2.0f, 1);
  ASSERT_TRUE(right.common && wrong.common);
  EXPECT_GT(right.rendered.matches, wrong.rendered.matches);  // own geometry selects pixels
  EXPECT_GT(right.common->rendered.matches, 300);             // of 704
  EXPECT_EQ(right.common->rendered.matches, wrong.common->rendered.matches);
  EXPECT_EQ(right.common->rendered.me, wrong.common->rendered.me);
  ASSERT_TRUE(right.common->truth);
  EXPECT_EQ(right.common->truth->matches, right.common->colored.matches);
}

TEST_F(SceneConsistencyTest, CommonMatchesNoticeSwappedColors) {
  const SceneConsistency good = Measure(1.0f, -1), swapped = Measure(1.0f, 1);
  EXPECT_LT(good.common->colored.me_de00, 0.5);
  EXPECT_GT(swapped.common->colored.me_de00, 5.0);
  EXPECT_GT(swapped.common->colored.tc, 10.0 * good.common->colored.tc + 1e-4);
  ASSERT_TRUE(swapped.common->truth);
  EXPECT_LT(swapped.common->truth->me_de00, 0.5);
}

TEST_F(SceneConsistencyTest, CommonMatchesNeedTheTruthOfOneView) {
  const SceneConsistency all = Measure(1.0f, 1);
  views_with_truth_ = 1;
  const SceneConsistency one = Measure(1.0f, 1);
  ASSERT_TRUE(all.common && one.common);
  EXPECT_EQ(one.common->colored.me_de00, all.common->colored.me_de00);
  EXPECT_FALSE(one.common->truth);
  EXPECT_FALSE(one.truth);
}

TEST_F(SceneConsistencyTest, HasNoCommonMatchesWithoutTruth) {
  views_with_truth_ = 0;
  const SceneConsistency scores = Measure(1.0f, -1);
  EXPECT_FALSE(scores.common);
  EXPECT_FALSE(scores.truth);
  EXPECT_GT(scores.rendered.matches, 0);
}

}  // namespace
}  // namespace color3d
