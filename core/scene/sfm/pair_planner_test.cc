#include "core/scene/sfm/pair_planner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace color3d {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;

// Photos on a closed ring, more similar the nearer they are.
SimilarityTable Ring(int count) {
  SimilarityTable table(count);
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      const int apart = std::min(j - i, count - (j - i));
      table.Set(i, j, 200.0f / apart);
    }
  }
  return table;
}

bool Connected(int count, const std::vector<PhotoPair>& pairs) {
  std::set<int> reached = {0};
  for (int round = 0; round < count; ++round) {
    for (const auto& [a, b] : pairs) {
      if (reached.count(a) + reached.count(b) == 1) reached.insert({a, b});
    }
  }
  return static_cast<int>(reached.size()) == count;
}

bool Has(const PairPlan& plan, int a, int b) {
  return std::binary_search(
      plan.pairs.begin(), plan.pairs.end(), PhotoPair{std::min(a, b), std::max(a, b)});
}

TEST(PairPlanner, PairsSimilarPhotosAcrossSeamOfRing) {
  const PairPlan plan = PlanPairs(Ring(40), {}, 6);
  for (int i = 0; i < 40; ++i) {
    for (int apart = 1; apart <= 3; ++apart) EXPECT_TRUE(Has(plan, i, (i + apart) % 40));
  }
  EXPECT_LE(plan.pairs.size(), 170u);
  EXPECT_THAT(plan.reason, HasSubstr("of 780 pairs"));
  EXPECT_TRUE(std::is_sorted(plan.pairs.begin(), plan.pairs.end()));
  EXPECT_EQ(std::adjacent_find(plan.pairs.begin(), plan.pairs.end()), plan.pairs.end());
}

// Nearest neighbours alone would leave two islands.
TEST(PairPlanner, JoinsIslandsByTwoBridges) {
  SimilarityTable table(40);
  for (int i = 0; i < 40; ++i) {
    for (int j = i + 1; j < 40; ++j) table.Set(i, j, i / 20 == j / 20 ? 100.0f : 0.0f);
  }
  table.Set(3, 33, 9.0f);
  table.Set(7, 25, 8.0f);
  const PairPlan plan = PlanPairs(table, {}, 4);
  EXPECT_TRUE(Connected(40, plan.pairs));
  EXPECT_TRUE(Has(plan, 3, 33));
  EXPECT_TRUE(Has(plan, 7, 25));
}

TEST(PairPlanner, ConnectsPhotosWithoutSimilarity) {
  const PairPlan plan = PlanPairs(SimilarityTable(60), {}, 2);
  EXPECT_TRUE(Connected(60, plan.pairs));
}

TEST(PairPlanner, AlwaysPairsNeighborsOfSequence) {
  std::vector<int> sequence;  // 0 17 34 11 28 5 ...
  for (int i = 0; i < 40; ++i) sequence.push_back(i * 17 % 40);
  const PairPlan plan = PlanPairs(Ring(40), sequence, 4);
  for (int i = 0; i + 2 < 40; ++i) {
    EXPECT_TRUE(Has(plan, sequence[i], sequence[i + 1]));
    EXPECT_TRUE(Has(plan, sequence[i], sequence[i + 2]));
  }
  EXPECT_THAT(plan.reason, HasSubstr("sequence"));
}

TEST(PairPlanner, GrowsLinearlyAndMatchesAllOfFewPhotos) {
  EXPECT_EQ(PlanPairs(Ring(8), {}, 8).pairs.size(), 28u);
  EXPECT_EQ(PlanPairs(Ring(2), {}, 8).pairs.size(), 1u);
  EXPECT_EQ(PlanPairs(Ring(1), {}, 8).pairs.size(), 0u);
  const double small = static_cast<double>(PlanPairs(Ring(50), {}, 8).pairs.size());
  EXPECT_LT(static_cast<double>(PlanPairs(Ring(200), {}, 8).pairs.size()), 4.5 * small);
}

TEST(PairPlanner, MatchesFramesWithNearAndFarNeighbors) {
  const auto one_camera = [](int count) { return std::vector<int>(count, 0); };
  EXPECT_EQ(PairsInSequence(one_camera(4)).pairs,
            (std::vector<PhotoPair>{{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}}));
  const PairPlan plan = PairsInSequence(one_camera(100));
  EXPECT_EQ(plan.pairs.size(), 99u + 98u + 96u + 92u + 84u);
  EXPECT_TRUE(std::is_sorted(plan.pairs.begin(), plan.pairs.end()));
  EXPECT_EQ(plan.related, 100);
  EXPECT_TRUE(PairsInSequence(one_camera(1)).pairs.empty());
  EXPECT_TRUE(FramesToCompare(one_camera(100)).empty());
}

TEST(PairPlanner, MatchesSimilarFramesAcrossCameras) {
  const std::vector<int> camera = {1, 1, 1, 2, 2, 2, 7};
  PairPlan plan = PairsInSequence(camera);
  EXPECT_EQ(plan.pairs, (std::vector<PhotoPair>{{0, 1}, {0, 2}, {1, 2}, {3, 4}, {3, 5}, {4, 5}}));
  EXPECT_THAT(FramesToCompare(camera), ElementsAre(0, 1, 2, 3, 4, 5, 6));
  std::vector<int> many(1000, 1);
  many.resize(1500, 2);
  const std::vector<int> compared = FramesToCompare(many);
  ASSERT_EQ(compared.size(), 120u);
  EXPECT_EQ(compared[0], 8);      // the middle of the first sixtieth
  EXPECT_EQ(compared[60], 1004);  // of the second camera
  SimilarityTable similarity(7);
  similarity.Set(2, 3, 50.0f);
  similarity.Set(0, 1, 90.0f);  // of one camera: ignored
  AddPairsAcross(camera, FramesToCompare(camera), similarity, &plan);
  EXPECT_TRUE(Has(plan, 2, 3));
  EXPECT_TRUE(Connected(7, plan.pairs)) << "some pairs of each two cameras are tried";
  EXPECT_EQ(plan.pairs.size(), 6u + 8u + 3u + 3u);
  EXPECT_TRUE(std::is_sorted(plan.pairs.begin(), plan.pairs.end()));
  EXPECT_THAT(plan.reason, HasSubstr("6 pairs of frames up to 16 apart, 14 across cameras"));
}

TEST(PairPlanner, FindsSequenceOrderFromNames) {
  EXPECT_THAT(SequenceOrder({"a/f10.png", "a/f9.png", "a/f8.png"}), Optional(ElementsAre(2, 1, 0)));
  EXPECT_THAT(SequenceOrder({"0001.jpg", "0003.jpg"}), Optional(ElementsAre(0, 1)));
  EXPECT_EQ(SequenceOrder({"left.jpg", "right.jpg"}), std::nullopt);
  EXPECT_EQ(SequenceOrder({"a1.jpg", "b2.jpg"}), std::nullopt);
  EXPECT_EQ(SequenceOrder({"f1.jpg", "f01.jpg"}), std::nullopt);  // which one is first?
  EXPECT_EQ(SequenceOrder({"f99999999999999999999.jpg"}), std::nullopt);
}

TEST(PairPlanner, PairsUnregisteredPhotosWithAll) {
  EXPECT_THAT(UnregisteredPairs({true, true, false, true}, {{0, 2}}),
              ElementsAre(PhotoPair{1, 2}, PhotoPair{2, 3}));
  EXPECT_TRUE(UnregisteredPairs({true, true}, {}).empty());
}

}  // namespace
}  // namespace color3d
