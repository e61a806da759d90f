#include "core/keyview/tracks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

using Tracks = std::vector<std::vector<int>>;

TEST(TrackCoverageTest, AgreesWithDefinition) {
  // Points: 3 in views 0 and 1, 1 in 1 and 2, 2 in 2 alone.
  const Tracks tracks{{0, 1}, {0, 1}, {0, 1}, {1, 2}, {2}, {2}};
  const std::vector<double> scores = TrackCoverage(tracks, {true, true, true});
  EXPECT_DOUBLE_EQ(scores[0], 0.5 * std::sqrt(3.0 / 4.0));
  EXPECT_DOUBLE_EQ(scores[1], 0.5 * (1.0 + std::sqrt(1.0 / 3.0)));
  EXPECT_DOUBLE_EQ(scores[2], 0.5 * std::sqrt(1.0 / 4.0));
}

TEST(TrackCoverageTest, IgnoresExcludedViews) {
  const Tracks tracks{{0, 1}, {0, 2}, {1, 2}, {1, 2}};
  const std::vector<double> scores = TrackCoverage(tracks, {true, false, true});
  EXPECT_DOUBLE_EQ(scores[0], std::sqrt(1.0 / 3.0));
  EXPECT_EQ(scores[1], 0.0);
}

// Along a path, each point is seen by a window of views, so that the middle view shares most
// points.
TEST(TrackCoverageTest, PrefersMiddleOfPath) {
  Tracks tracks;
  for (int start = -4; start < 31; ++start) {
    for (int copy = 0; copy < 30; ++copy) {
      tracks.emplace_back();
      for (int view = std::max(0, start); view <= std::min(30, start + 6); ++view) {
        tracks.back().push_back(view);
      }
    }
  }
  const std::vector<double> scores = TrackCoverage(tracks, std::vector<bool>(31, true));
  EXPECT_GT(scores[15], scores[0]);
  EXPECT_GT(scores[15], scores[30]);
}

TEST(TrackCoverageTest, ReportsUnusableTracks) {
  const std::vector<bool> kept(4, true);
  EXPECT_NE(UnusableTracksReason({}, kept), "");
  EXPECT_EQ(UnusableTracksReason(Tracks(20, {0, 1, 2}), kept), "");
  EXPECT_NE(UnusableTracksReason(Tracks(19, {0, 1, 2}), kept), "");
  EXPECT_NE(UnusableTracksReason(Tracks(100, {2}), kept), "");
  EXPECT_THROW(TrackCoverage({{0, 4}}, kept), Error);
  EXPECT_THROW(TrackCoverage({{-1}}, kept), Error);
}

// 50,000 points, each seen by 200 of 2000 views.
TEST(TrackCoverageTest, HandlesLongTracksOfManyViews) {
  Tracks tracks(50'000);
  for (size_t p = 0; p < tracks.size(); ++p) {
    for (int view = static_cast<int>(p % 1800); tracks[p].size() < 200; ++view) {
      tracks[p].push_back(view);
    }
  }
  const std::vector<double> scores = TrackCoverage(tracks, std::vector<bool>(2000, true));
  EXPECT_GT(scores[1000], scores[5]);
}

}  // namespace
}  // namespace color3d
