// Do two views show the same colour where they show the same surface? Matching error (ME) and
// temporal consistency (TC) of METHOD.md "Metrics", with matches from geometry: poses and depth.
// Pure functions and values, thread-safe.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/scene/camera.h"

namespace color3d {

// What a view sees, of any origin.
struct PosedDepth {
  Camera camera;
  Pose cam_from_world;
  Image
      depth;  // 1 channel of the camera's size: along the z axis, scene units; <= 0: nothing there
};

struct MatchOptions {
  double max_reprojection_px = 1.0;  // there and back again, 0..100
  double depth_tolerance = 0.01;     // relative, 0..1
  int stride_px = 1;                 // every n-th pixel of every n-th row, 1..1000
  void Validate() const;             // throws Error{kInvalidArgument}
};

// Pixel (x, y) of the first view, and the point of the second picture that shows the same surface,
// px with pixel centres at +0.5.
struct PixelMatch {
  int x = 0;
  int y = 0;
  float u = 0.0f;
  float v = 0.0f;
};

// A pixel matches when its surface point falls into the second picture, lies there at the depth
// that the second view sees (so nothing stands before it), and that view's own surface point comes
// back to the pixel. In rows from top to bottom. Throws Error{kInvalidArgument} when a depth map is
// not of its camera's size.
std::vector<PixelMatch> MatchByGeometry(const PosedDepth& from,
                                        const PosedDepth& to,
                                        const MatchOptions& options);

// A picture twice: 3 channels of sRGB in 0..1, and of Lab.
struct ColoredPicture {
  Image srgb;
  Image lab;
};

// Means over the matches of a pair; `to` is sampled bilinearly.
struct PairDifference {
  int64_t matches = 0;
  double absolute_rgb = 0.0;  // |difference| of the three channels, 0..1
  double squared_rgb = 0.0;   // its square: the warping error of Lai et al. 2018 (section 4)
  double delta_e00 = 0.0;
};
// Throws Error{kInvalidArgument} for a match outside of a picture.
PairDifference CompareMatches(const ColoredPicture& from,
                              const ColoredPicture& to,
                              const std::vector<PixelMatch>& matches);

struct ViewPair {
  int first = 0;
  int second = 0;
  bool long_gap = false;
};
inline constexpr int kShortGap = 1;
inline constexpr int kLongGap = 7;
// `groups`: how many views each has, which are numbered on from group to group; two of one group
// are compared. All (i, i + 1) and (i, i + 7), at most `most` of each over all groups, evenly
// spread; by `first`, then `second`. In a group of fewer than 8 views the long gap is that of the
// first and the last view (none below 3).
std::vector<ViewPair> ConsistencyPairs(const std::vector<int>& groups, int most);

struct Consistency {
  int pairs = 0;          // that have matches
  int64_t matches = 0;    // over all pairs
  double me = 0.0;        // mean over all matches of |dRGB|, 0..1
  double me_de00 = 0.0;   // the same in CIEDE2000
  double tc_short = 0.0;  // mean over the pairs of squared_rgb
  double tc_long = 0.0;
  double tc = 0.0;  // mean of both; the one that there is when the other has no match

  // The metrics by their keys (core/catalogue/metrics.h).
  std::map<std::string, double> Figures() const {
    return {
        {"me", me}, {"me_de00", me_de00}, {"tc", tc}, {"tc_short", tc_short}, {"tc_long", tc_long}};
  }
};

// Sums up pairs. A plain value.
class ConsistencyMeter {
 public:
  void Add(const ViewPair& pair, const PairDifference& difference);
  Consistency Result() const;

 private:
  double absolute_ = 0.0, delta_e00_ = 0.0;
  int64_t matches_ = 0;
  double squared_[2] = {0.0, 0.0};  // short, long
  int pairs_[2] = {0, 0};
};

}  // namespace color3d
