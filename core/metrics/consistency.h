// Agreement of two views where they show the same surface: matching error (ME) and temporal
// consistency (TC) of METHOD.md "Metrics", with matches from poses and depth. Pure functions and
// values.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/scene/camera.h"

namespace color3d {

// A camera with its depth map, from any source.
struct PosedDepth {
  Camera camera;
  Pose cam_from_world;
  Image
      depth;  // 1 channel of the camera's size: along the z axis, scene units; <= 0: nothing there
};

struct MatchOptions {
  double max_reprojection_px = 1.0;  // after the way there and back, 0..100
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

// A pixel matches if its surface point falls into the second picture, is not occluded there (equal
// depth), and the surface point of the second view reprojects to the pixel. In rows from top to
// bottom. Throws Error{kInvalidArgument} if a depth map does not have the size of its camera.
std::vector<PixelMatch> MatchByGeometry(const PosedDepth& from,
                                        const PosedDepth& to,
                                        const MatchOptions& options);

// A picture in sRGB (0..1) and in Lab, 3 channels each.
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
// Throws Error{kInvalidArgument} for a match outside a picture.
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
// All pairs (i, i + 1) and (i, i + 7) within a group, at most `most` of each kind over all groups,
// evenly spread, ordered by `first`, then `second`. In a group of fewer than 8 views the long gap
// is that of the first and the last view; groups of fewer than 3 have none. `groups`: number of
// views of each; views are numbered through all groups.
std::vector<ViewPair> ConsistencyPairs(const std::vector<int>& groups, int most);

struct Consistency {
  int pairs = 0;          // with matches
  int64_t matches = 0;    // over all pairs
  double me = 0.0;        // mean over all matches of |dRGB|, 0..1
  double me_de00 = 0.0;   // the same in CIEDE2000
  double tc_short = 0.0;  // mean over the pairs of squared_rgb
  double tc_long = 0.0;
  double tc = 0.0;  // mean of both; of one if the other has no match

  // The metrics by their keys (core/catalogue/metrics.h).
  std::map<std::string, double> Figures() const {
    return {
        {"me", me}, {"me_de00", me_de00}, {"tc", tc}, {"tc_short", tc_short}, {"tc_long", tc_long}};
  }
};

// Accumulates pairs. A plain value.
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
