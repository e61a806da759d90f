#include "core/keyview/coverage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

Image RandomGrid(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  Image grid(width, height, channels);
  for (float& value : grid.data) value = static_cast<float>(random.NextNormal());
  return grid;
}

// Straight from the definition, float64, all cells and all channels.
std::vector<std::vector<double>> DirectDistances(const std::vector<Image>& views) {
  const int channels = views[0].channels;
  std::vector<double> mean(channels, 0.0), deviation(channels, 0.0);
  double count = 0.0;
  for (const Image& view : views) count += static_cast<double>(view.PlaneSize());
  for (int c = 0; c < channels; ++c) {
    for (const Image& view : views) {
      for (size_t i = 0; i < view.PlaneSize(); ++i) mean[c] += view.Plane(c)[i] / count;
    }
    for (const Image& view : views) {
      for (size_t i = 0; i < view.PlaneSize(); ++i) {
        deviation[c] += std::pow(view.Plane(c)[i] - mean[c], 2) / count;
      }
    }
    deviation[c] = std::sqrt(deviation[c]);
  }
  std::vector<std::vector<double>> result(views.size(), std::vector<double>(views.size()));
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = 0; j < views.size(); ++j) {
      double sum = 0.0;
      for (size_t q = 0; q < views[j].PlaneSize(); ++q) {
        double nearest = std::numeric_limits<double>::infinity();
        for (size_t p = 0; p < views[i].PlaneSize(); ++p) {
          double squares = 0.0;
          for (int c = 0; c < channels; ++c) {
            squares += std::pow((views[i].Plane(c)[p] - views[j].Plane(c)[q]) / deviation[c], 2);
          }
          nearest = std::min(nearest, squares / channels);
        }
        sum += std::sqrt(nearest);
      }
      result[i][j] = sum / static_cast<double>(views[j].PlaneSize());
    }
  }
  return result;
}

TEST(FeatureDistancesTest, AgreesWithTheDefinition) {
  const std::vector<Image> views{
      RandomGrid(5, 4, 6, 1), RandomGrid(3, 7, 6, 2), RandomGrid(4, 4, 6, 3)};
  NullObserver progress;
  const auto distances = FeatureDistances(views, progress, {});
  const auto direct = DirectDistances(views);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) EXPECT_NEAR(distances[i][j], direct[i][j], 1e-3);
  }
}

TEST(FeatureDistancesTest, AViewThatContainsAnotherExplainsIt) {
  const Image small = RandomGrid(4, 4, 5, 1);
  Image large(4, 8, 5);
  const Image extra = RandomGrid(4, 4, 5, 2);
  for (int c = 0; c < 5; ++c) {
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 4; ++x) {
        large.At(c, y, x) = y < 4 ? small.At(c, y, x) : extra.At(c, y - 4, x);
      }
    }
  }
  NullObserver progress;
  const auto distances = FeatureDistances({small, large}, progress, {});
  EXPECT_NEAR(distances[1][0], 0.0, 2e-3);
  EXPECT_GT(distances[0][1], 0.1);
}

TEST(FeatureDistancesTest, ConstantAndNonFiniteFeaturesHaveAnAnswer) {
  std::vector<Image> views{Image(3, 3, 4, 1.0f), Image(3, 3, 4, 1.0f)};
  views[1].data[5] = std::numeric_limits<float>::quiet_NaN();
  NullObserver progress;
  const auto distances = FeatureDistances(views, progress, {});
  for (const auto& row : distances) {
    for (double value : row) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST(FeatureDistancesTest, RefusesBadShapesAndStopsWhenCancelled) {
  NullObserver progress;
  EXPECT_THROW(FeatureDistances({}, progress, {}), Error);
  EXPECT_THROW(FeatureDistances({Image(2, 2, 3), Image(2, 2, 4)}, progress, {}), Error);
  EXPECT_THROW(FeatureDistances({Image()}, progress, {}), Error);
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(FeatureDistances({Image(2, 2, 3)}, progress, cancel), Error);
}

TEST(FeatureDistancesTest, TwoHundredViewsTakeSeconds) {
  std::vector<Image> views;
  for (int i = 0; i < 200; ++i) views.push_back(RandomGrid(24, 18, 192, i));
  NullObserver progress;
  const auto distances = FeatureDistances(views, progress, {});
  EXPECT_EQ(distances.size(), 200u);
  EXPECT_GT(distances[0][199], 0.0);
}

}  // namespace
}  // namespace color3d
