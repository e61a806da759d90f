#include "core/keyview/select.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

using Matrix = std::vector<std::vector<double>>;

Matrix RandomFeatures(int views, int dims, uint64_t seed) {
  Random random(seed);
  Matrix features(views, std::vector<double>(dims));
  for (auto& row : features) {
    for (double& value : row) value = random.NextUniform(-0.2, 1.0);
  }
  return features;
}

KeyViewOptions Entropy() {
  KeyViewOptions options;
  options.strategy = KeyViewStrategy::kEntropy;
  options.outlier_guard = false;
  return options;
}

KeyViewSelection SelectByEntropy(const Matrix& features, const KeyViewOptions& options) {
  ThreadPool pool;
  GuardedViews guarded = GuardViews(features, {}, options);
  const std::vector<double> scores = SoftmaxEntropies(features, guarded.Kept(), options, pool);
  return RankViews(std::move(guarded), scores);
}

// The formula of STILL.md, step by step.
std::vector<double> DirectEntropies(const Matrix& features, double temperature, bool exclude_self) {
  const size_t n = features.size();
  Matrix unit = features;
  for (auto& row : unit) {
    double norm = 0.0;
    for (double value : row) norm += value * value;
    for (double& value : row) value /= std::sqrt(norm);
  }
  std::vector<double> entropies;
  for (size_t i = 0; i < n; ++i) {
    std::vector<double> p(n, 0.0);
    double sum = 0.0;
    for (size_t j = 0; j < n; ++j) {
      if (exclude_self && i == j) continue;
      double s = 0.0;
      for (size_t d = 0; d < unit[i].size(); ++d) s += unit[i][d] * unit[j][d];
      sum += p[j] = std::exp(s / temperature);
    }
    double h = 0.0;
    for (double value : p) {
      if (value > 0.0) h -= value / sum * std::log(value / sum);
    }
    entropies.push_back(h);
  }
  return entropies;
}

TEST(SelectKeyViewTest, EntropyAgreesWithDirectFormula) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    for (bool exclude_self : {false, true}) {
      for (double temperature : {1.0, 0.1}) {
        const Matrix features = RandomFeatures(17 + 60 * static_cast<int>(seed), 6, seed);
        KeyViewOptions options = Entropy();
        options.temperature = temperature;
        options.exclude_self = exclude_self;
        const KeyViewSelection selection = SelectByEntropy(features, options);
        const std::vector<double> direct = DirectEntropies(features, temperature, exclude_self);
        size_t best = 0;
        for (size_t i = 0; i < direct.size(); ++i) {
          if (direct[i] > direct[best]) best = i;
        }
        EXPECT_EQ(selection.index, static_cast<int>(best));
        for (const RankedView& view : selection.ranking) {
          EXPECT_NEAR(view.score, direct[view.index], 1e-12);
        }
        EXPECT_NEAR(selection.margin, selection.ranking[0].score - selection.ranking[1].score, 0.0);
      }
    }
  }
}

TEST(SelectKeyViewTest, IgnoresScaleOfDescriptors) {
  Matrix features = RandomFeatures(9, 5, 3);
  const KeyViewSelection before = SelectByEntropy(features, Entropy());
  for (double& value : features[4]) value *= 1e200;  // squares would overflow
  for (double& value : features[5]) value *= 1e-200;
  const KeyViewSelection after = SelectByEntropy(features, Entropy());
  ASSERT_EQ(before.ranking.size(), after.ranking.size());
  for (size_t i = 0; i < before.ranking.size(); ++i) {
    EXPECT_EQ(before.ranking[i].index, after.ranking[i].index);
    EXPECT_NEAR(before.ranking[i].score, after.ranking[i].score, 1e-12);
  }
}

TEST(SelectKeyViewTest, StaysFiniteAtTinyTemperature) {
  KeyViewOptions options = Entropy();
  options.temperature = 1e-6;
  const KeyViewSelection selection = SelectByEntropy(RandomFeatures(8, 4, 2), options);
  for (const RankedView& view : selection.ranking) EXPECT_TRUE(std::isfinite(view.score));
}

TEST(SelectKeyViewTest, PrefersLowestIndexAmongDuplicates) {
  const Matrix features(7, std::vector<double>{0.3, 0.5, 0.1});
  const KeyViewSelection selection = SelectByEntropy(features, {});
  EXPECT_EQ(selection.index, 0);
  EXPECT_EQ(selection.margin, 0.0);
  EXPECT_TRUE(selection.warnings.empty());
  for (size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(selection.ranking[i].index, static_cast<int>(i));
    EXPECT_NEAR(selection.ranking[i].score, std::log(7.0), 1e-12);
  }
}

TEST(SelectKeyViewTest, ChoosesTheOnlyView) {
  for (bool exclude_self : {false, true}) {
    KeyViewOptions options = Entropy();
    options.exclude_self = exclude_self;
    const KeyViewSelection selection = SelectByEntropy({{1.0, 2.0}}, options);
    EXPECT_EQ(selection.index, 0);
    EXPECT_EQ(selection.ranking[0].score, 0.0);
  }
}

TEST(SelectKeyViewTest, ExcludesUnusableDescriptorsWithWarning) {
  Matrix features = RandomFeatures(6, 4, 1);
  features[0].assign(4, 0.0);
  features[2][1] = std::numeric_limits<double>::quiet_NaN();
  features[3][0] = std::numeric_limits<double>::infinity();
  const KeyViewSelection selection = SelectByEntropy(features, Entropy());
  ASSERT_EQ(selection.warnings.size(), 1u);
  EXPECT_NE(selection.warnings[0].find("0, 2, 3"), std::string::npos) << selection.warnings[0];
  EXPECT_TRUE(selection.index == 1 || selection.index >= 4);
  for (int i = 3; i < 6; ++i) EXPECT_FALSE(selection.ranking[i].set_aside.empty());
}

TEST(SelectKeyViewTest, RefusesUnusableDescriptors) {
  EXPECT_THROW(SelectByEntropy({}, {}), Error);
  EXPECT_THROW(SelectByEntropy({{0.0, 0.0}, {0.0, 0.0}}, {}), Error);
  EXPECT_THROW(SelectByEntropy({{1.0, 0.0}, {0.0}}, {}), Error);
}

// A chain of views, each like its neighbours, and one frame equally unlike all.
Matrix ChainWithOutlier(int views, int outlier) {
  Random random(42);
  const int dims = 400;
  Matrix features(views, std::vector<double>(dims));
  std::vector<double> common(dims);
  for (double& value : common) value = random.NextNormal();
  for (int i = 0; i < views; ++i) {
    for (int d = 0; d < dims; ++d) {
      // A bump that moves along the chain, added to features that all views share.
      const double position = (i + 0.5) / views * dims;
      const double bump = 4.0 * std::exp(-std::pow((d - position) / 60.0, 2));
      features[i][d] = i == outlier ? random.NextNormal() : common[d] + bump;
    }
  }
  return features;
}

TEST(SelectKeyViewTest, OutlierGuardExcludesOutlier) {
  const Matrix features = ChainWithOutlier(100, 37);
  const KeyViewSelection unguarded = SelectByEntropy(features, Entropy());
  EXPECT_EQ(unguarded.index, 37) << "the guard compensates for this weakness of the formula";
  KeyViewOptions options = Entropy();
  options.outlier_guard = true;
  const KeyViewSelection guarded = SelectByEntropy(features, options);
  EXPECT_NE(guarded.index, 37);
  std::string reason;
  for (const RankedView& view : guarded.ranking) {
    if (view.index == 37) reason = view.set_aside;
  }
  EXPECT_EQ(reason, "unlike the others");
  EXPECT_EQ(guarded.ranking[0].set_aside, "");
}

// An excluded frame neither wins nor changes the scores of the others.
TEST(SelectKeyViewTest, ExcludedViewDoesNotChangeOtherScores) {
  Matrix features = RandomFeatures(12, 5, 4);
  const KeyViewSelection before = SelectByEntropy(features, {});
  features.push_back(RandomFeatures(1, 5, 99)[0]);
  std::vector<std::string> unfit(13);
  unfit[12] = "blank";
  ThreadPool pool;
  GuardedViews guarded = GuardViews(features, unfit, {});
  const std::vector<double> scores = SoftmaxEntropies(features, guarded.Kept(), {}, pool);
  const KeyViewSelection after = RankViews(std::move(guarded), scores);
  EXPECT_EQ(after.ranking.back().set_aside, "blank");
  EXPECT_EQ(after.index, before.index);
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(after.ranking[i].index, before.ranking[i].index);
    EXPECT_EQ(after.ranking[i].score, before.ranking[i].score);
  }
}

TEST(SelectKeyViewTest, KeepsAllFramesWhenAllAreUnfit) {
  const Matrix features = RandomFeatures(3, 4, 8);
  const GuardedViews guarded = GuardViews(features, {"blank", "blank", "blank"}, {});
  EXPECT_EQ(guarded.Kept(), std::vector<bool>(3, true));
}

TEST(SelectKeyViewTest, ComparesViewsWithinGroup) {
  Matrix features;  // of two shots, the second with an outlier
  for (int i = 0; i < 12; ++i) features.push_back({1.0, 0.01 * (i % 3), 0.0});
  for (int i = 0; i < 5; ++i) features.push_back({0.0, 1.0, 0.01 * (i % 2)});
  features.push_back({0.0, 0.5, -1.0});
  std::vector<int> shots(12, 4);
  shots.resize(features.size(), 7);
  const std::vector<bool> alone = GuardViews(features, {}, {}).Kept();
  EXPECT_EQ(std::count(alone.begin() + 12, alone.end(), true), 0) << "the shorter shot differs";
  const std::vector<bool> kept = GuardViews(features, {}, {}, shots).Kept();
  EXPECT_EQ(std::count(kept.begin(), kept.end() - 1, true), 17);
  EXPECT_FALSE(kept.back());
  EXPECT_THROW(GuardViews(features, {}, {}, {1, 2}), Error);
}

TEST(SelectKeyViewTest, MeasuresMarginRelativeToMedian) {
  GuardedViews guarded = GuardViews(RandomFeatures(5, 4, 8), {}, {.outlier_guard = false});
  const KeyViewSelection selection = RankViews(guarded, {1.0, 9.0, 7.0, 3.0, 5.0});
  EXPECT_EQ(selection.index, 1);
  EXPECT_DOUBLE_EQ(selection.margin, 2.0);
  EXPECT_DOUBLE_EQ(selection.decisiveness, 0.5);  // 2 of the 4 from the winner to the median
  EXPECT_DOUBLE_EQ(RankViews(guarded, {5.0, 5.0, 5.0, 5.0, 5.0}).decisiveness, 0.0);
}

TEST(SelectKeyViewTest, RefusesBadOptionsAndShapes) {
  KeyViewOptions options;
  options.temperature = 0.0;
  EXPECT_THROW(SelectByEntropy(RandomFeatures(3, 2, 1), options), Error);
  const GuardedViews guarded = GuardViews(RandomFeatures(3, 2, 1), {}, {});
  EXPECT_THROW(RankViews(guarded, {1.0, 2.0}), Error);
  EXPECT_THROW(RankViews(guarded, {1.0, 2.0, std::nan("")}), Error);
  EXPECT_THROW(GuardViews(RandomFeatures(3, 2, 1), {"", ""}, {}), Error);
}

// Bars: 300 views in less than 10 ms (with room for a busy machine), 2000 in seconds.

}  // namespace
}  // namespace color3d
