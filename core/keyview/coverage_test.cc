#include "core/keyview/coverage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>
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

ViewFeatures Packed(const Image& grid) { return PackViewFeatures({1.0}, {}, grid, 7); }

std::vector<ViewFeatures> Packed(const std::vector<Image>& grids) {
  std::vector<ViewFeatures> views;
  for (const Image& grid : grids) views.push_back(Packed(grid));
  return views;
}

std::vector<double> Distances(const std::vector<ViewFeatures>& views,
                              const std::vector<bool>& kept,
                              const CancellationToken& cancel = {}) {
  ThreadPool pool;
  NoCheckpoints none;
  NullObserver silent;
  return MeanFeatureDistances(views, kept, {pool, none, silent, cancel});
}

std::vector<double> Distances(const std::vector<ViewFeatures>& views) {
  return Distances(views, std::vector<bool>(views.size(), true));
}

// By the definition, in float64, for all cells and channels.
std::vector<double> DirectDistances(const std::vector<Image>& views) {
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
  std::vector<double> result(views.size(), 0.0);
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
      if (j == i) continue;
      result[i] += sum / static_cast<double>(views[j].PlaneSize() * (views.size() - 1));
    }
  }
  return result;
}

TEST(FeatureDistancesTest, AgreesWithDefinition) {
  const std::vector<Image> views{
      RandomGrid(5, 4, 6, 1), RandomGrid(3, 7, 6, 2), RandomGrid(4, 4, 6, 3)};
  const auto distances = Distances(Packed(views));
  const auto direct = DirectDistances(views);
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(distances[i], direct[i], 2e-3);
}

TEST(FeatureDistancesTest, IsZeroForContainedView) {
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
  const auto distances = Distances(Packed(std::vector<Image>{small, large}));
  EXPECT_NEAR(distances[1], 0.0, 4e-3);
  EXPECT_GT(distances[0], 0.1);
}

TEST(FeatureDistancesTest, IgnoresViewsThatAreNotKept) {
  std::vector<ViewFeatures> views =
      Packed({RandomGrid(5, 4, 6, 1), RandomGrid(3, 7, 6, 2), RandomGrid(4, 4, 6, 3)});
  const auto before = Distances(views);
  views.push_back(Packed(Image(6, 6, 6, 1000.0f)));
  const auto after = Distances(views, {true, true, true, false});
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(after[i], before[i]);
  EXPECT_EQ(after[3], 0.0);
}

TEST(FeatureDistancesTest, AcceptsConstantAndNonFiniteFeatures) {
  std::vector<Image> views{Image(3, 3, 4, 1.0f), Image(3, 3, 4, 1.0f)};
  views[1].data[5] = std::numeric_limits<float>::quiet_NaN();
  for (double value : Distances(Packed(views))) EXPECT_TRUE(std::isfinite(value));
  EXPECT_EQ(Distances({Packed(views[0])}), std::vector<double>{0.0});
}

TEST(FeatureDistancesTest, RefusesBadShapesAndStopsWhenCancelled) {
  EXPECT_THROW(Distances(std::vector<ViewFeatures>(), {}), Error);
  EXPECT_THROW(Distances(Packed({Image(2, 2, 3), Image(2, 2, 4)})), Error);
  EXPECT_THROW(Distances({ViewFeatures()}), Error);
  EXPECT_THROW(Packed(Image()), Error);
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(Distances({Packed(Image(2, 2, 3))}, {true}, cancel), Error);
}

// View 7 contains a part of every other view and must win with few cells per view, too.
TEST(FeatureDistancesTest, KeepsBestViewWhenSubsampled) {
  for (int count : {20, 400}) {
    std::vector<Image> grids;
    for (int i = 0; i < count; ++i) {
      Image grid = RandomGrid(20, 12, 8, 1 + i);
      for (float& value : grid.data) value = 0.1f * value + static_cast<float>(i % 20);
      grids.push_back(std::move(grid));
    }
    for (int c = 0; c < 8; ++c) {
      for (int y = 0; y < 12; ++y) {
        for (int x = 0; x < 20; ++x) grids[7].At(c, y, x) = static_cast<float>(x);
      }
    }
    const auto distances = Distances(Packed(grids));
    EXPECT_EQ(std::min_element(distances.begin(), distances.end()) - distances.begin(), 7);
  }
}

TEST(FeatureDistancesTest, IsRepeatableFor2000Views) {
  std::vector<ViewFeatures> views;
  for (int i = 0; i < 2000; ++i) {
    views.push_back(Packed(RandomGrid(8, 8, 48, i)));
    views.back().KeepCells(CellsForCoverage(2000, 48));
  }
  const auto distances = Distances(views);
  EXPECT_GT(*std::min_element(distances.begin(), distances.end()), 0.0);
  EXPECT_EQ(Distances(views), distances);
}

TEST(ViewFeaturesTest, RoundTripsAndRefusesTruncatedBytes) {
  ViewFeatures view =
      PackViewFeatures({0.5, -2.0}, {10.0, 3.0, 0.8, 0.9}, RandomGrid(30, 20, 5, 3), 11);
  view.thumbnail = "picture";
  EXPECT_EQ(view.Cells(), ViewFeatures::kMaxCells);
  const std::string bytes = SerializeViewFeatures(view);
  const auto back = ParseViewFeatures(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->descriptor, view.descriptor);
  EXPECT_EQ(back->content.structure, 0.8);
  EXPECT_EQ(back->deep, view.deep);
  EXPECT_EQ(back->thumbnail, "picture");
  for (size_t size : {size_t{0}, size_t{3}, size_t{40}, bytes.size() - 1}) {
    EXPECT_FALSE(ParseViewFeatures(std::string_view(bytes).substr(0, size)));
  }
  EXPECT_FALSE(ParseViewFeatures(bytes + "x"));
}

// Every prefix of the cells is spread over the picture.
TEST(ViewFeaturesTest, SpreadsFewCellsEvenly) {
  Image grid(24, 18, 2);
  for (int y = 0; y < 18; ++y) {
    for (int x = 0; x < 24; ++x) {
      grid.At(0, y, x) = static_cast<float>(x);
      grid.At(1, y, x) = static_cast<float>(y);
    }
  }
  for (uint64_t seed = 0; seed < 20; ++seed) {
    ViewFeatures view = PackViewFeatures({1.0}, {}, grid, seed);
    view.KeepCells(12);
    ASSERT_EQ(view.Cells(), 12);
    std::set<std::pair<bool, bool>> quarters;
    for (int i = 0; i < 12; ++i) {
      const auto value = [&](int c) {  // of a half; these are small whole numbers
        const int bits = view.deep[2 * i + c];
        return bits == 0 ? 0.0 : std::ldexp(1.0 + (bits & 1023) / 1024.0, (bits >> 10) - 15);
      };
      quarters.emplace(value(0) < 12, value(1) < 9);
    }
    EXPECT_EQ(quarters.size(), 4u) << seed;
  }
}

}  // namespace
}  // namespace color3d
