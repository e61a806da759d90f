#include "core/metrics/consistency.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/base/evenly.h"
#include "core/base/range_check.h"
#include "core/color/difference.h"

namespace color3d {
namespace {

void CheckDepth(const PosedDepth& view) {
  const Image& d = view.depth;
  if (d.channels == 1 && d.width == view.camera.width && d.height == view.camera.height &&
      !d.Empty() && view.camera.fx > 0.0 && view.camera.fy > 0.0) {
    return;
  }
  throw InvalidArgument("a depth map of {} x {} x {} does not fit its camera of {} x {} px",
                        d.width,
                        d.height,
                        d.channels,
                        view.camera.width,
                        view.camera.height);
}

// Bilinear weights of the four pixels around (u, v). Pixel centres are at +0.5.
struct Corners {
  int x = 0, y = 0;         // upper left
  int right = 0, down = 0;  // steps to the others; 0 at the border
  double fx = 0.0, fy = 0.0;

  double Mix(const Image& image, int c) const {
    const double top = image.At(c, y, x) * (1.0 - fx) + image.At(c, y, x + right) * fx;
    const double bottom =
        image.At(c, y + down, x) * (1.0 - fx) + image.At(c, y + down, x + right) * fx;
    return top * (1.0 - fy) + bottom * fy;
  }
};

// Returns nullopt if (u, v) is outside the picture.
std::optional<Corners> CornersAt(double u, double v, int width, int height) {
  if (!(u >= 0.0 && v >= 0.0 && u <= width && v <= height)) return std::nullopt;
  const double x = std::clamp(u - 0.5, 0.0, width - 1.0);
  const double y = std::clamp(v - 0.5, 0.0, height - 1.0);
  Corners c;
  c.x = static_cast<int>(x);
  c.y = static_cast<int>(y);
  c.right = c.x + 1 < width ? 1 : 0;
  c.down = c.y + 1 < height ? 1 : 0;
  c.fx = x - c.x;
  c.fy = y - c.y;
  return c;
}

// Interpolated depth. Requires depth at all four pixels.
double DepthAt(const Image& depth, const Corners& c) {
  for (const int y : {c.y, c.y + c.down}) {
    for (const int x : {c.x, c.x + c.right}) {
      if (!(depth.At(0, y, x) > 0.0f)) return 0.0;
    }
  }
  return c.Mix(depth, 0);
}

// x_to = rotation x_from + translation.
struct Motion {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;

  Motion(const Pose& from, const Pose& to)
      : rotation((to.rotation * from.rotation.conjugate()).toRotationMatrix()),
        translation(to.translation - rotation * from.translation) {}
  Eigen::Vector3d Apply(const Eigen::Vector3d& x) const { return rotation * x + translation; }
};

void CheckPicture(const ColoredPicture& p) {
  if (p.srgb.channels == 3 && p.lab.channels == 3 && !p.srgb.Empty() &&
      p.srgb.width == p.lab.width && p.srgb.height == p.lab.height) {
    return;
  }
  throw InvalidArgument(
      "pictures to compare need 3 channels of sRGB and of Lab in one size, got {} x {} x {} and {} "
      "x {} x {}",
      p.srgb.width,
      p.srgb.height,
      p.srgb.channels,
      p.lab.width,
      p.lab.height,
      p.lab.channels);
}

void AddPairs(int begin, int views, int gap, bool long_gap, std::vector<ViewPair>* pairs) {
  for (int first = begin; first + gap < begin + views; ++first) {
    pairs->push_back({first, first + gap, long_gap});
  }
}

}  // namespace

void MatchOptions::Validate() const {
  const RangeCheck check("match option");
  check("max_reprojection_px", max_reprojection_px, 0.0, 100.0);
  check("depth_tolerance", depth_tolerance, 0.0, 1.0);
  check("stride_px", stride_px, 1.0, 1000.0);
}

std::vector<PixelMatch> MatchByGeometry(const PosedDepth& from,
                                        const PosedDepth& to,
                                        const MatchOptions& options) {
  options.Validate();
  CheckDepth(from);
  CheckDepth(to);
  const Motion forth(from.cam_from_world, to.cam_from_world);
  const Motion back(to.cam_from_world, from.cam_from_world);
  const double max_distance2 = options.max_reprojection_px * options.max_reprojection_px;
  std::vector<PixelMatch> matches;
  for (int y = 0; y < from.camera.height; y += options.stride_px) {
    for (int x = 0; x < from.camera.width; x += options.stride_px) {
      const double depth = from.depth.At(0, y, x);
      if (!(depth > 0.0) || !std::isfinite(depth)) continue;
      const Eigen::Vector3d there = forth.Apply(depth * from.camera.Ray(x + 0.5, y + 0.5));
      if (!(there.z() > 0.0)) continue;
      const Eigen::Vector2d pixel = to.camera.Project(there);
      const double u = pixel.x(), v = pixel.y();
      const auto corners = CornersAt(u, v, to.camera.width, to.camera.height);
      if (!corners) continue;
      const double seen = DepthAt(to.depth, *corners);
      if (!(std::abs(seen - there.z()) <= options.depth_tolerance * there.z())) continue;
      const Eigen::Vector3d again = back.Apply(seen * to.camera.Ray(u, v));
      if (!(again.z() > 0.0)) continue;
      const Eigen::Vector2d off = from.camera.Project(again) - Eigen::Vector2d(x + 0.5, y + 0.5);
      if (!(off.squaredNorm() < max_distance2)) continue;
      matches.push_back({x, y, static_cast<float>(u), static_cast<float>(v)});
    }
  }
  return matches;
}

PairDifference CompareMatches(const ColoredPicture& from,
                              const ColoredPicture& to,
                              const std::vector<PixelMatch>& matches) {
  CheckPicture(from);
  CheckPicture(to);
  PairDifference sum;
  for (const PixelMatch& m : matches) {
    const auto corners = CornersAt(m.u, m.v, to.srgb.width, to.srgb.height);
    if (!corners || m.x < 0 || m.y < 0 || m.x >= from.srgb.width || m.y >= from.srgb.height) {
      throw InvalidArgument(
          "the match of pixel ({}, {}) lies outside of a picture; match views at the pictures' "
          "size",
          m.x,
          m.y);
    }
    for (int c = 0; c < 3; ++c) {
      const double d = from.srgb.At(c, m.y, m.x) - corners->Mix(to.srgb, c);
      sum.absolute_rgb += std::abs(d) / 3.0;
      sum.squared_rgb += d * d / 3.0;
    }
    sum.delta_e00 +=
        DeltaE00({from.lab.At(0, m.y, m.x), from.lab.At(1, m.y, m.x), from.lab.At(2, m.y, m.x)},
                 {corners->Mix(to.lab, 0), corners->Mix(to.lab, 1), corners->Mix(to.lab, 2)});
  }
  sum.matches = static_cast<int64_t>(matches.size());
  if (sum.matches == 0) return sum;
  const auto count = static_cast<double>(sum.matches);
  return {sum.matches, sum.absolute_rgb / count, sum.squared_rgb / count, sum.delta_e00 / count};
}

std::vector<ViewPair> ConsistencyPairs(const std::vector<int>& groups, int most) {
  std::vector<ViewPair> short_pairs, long_pairs;
  int begin = 0;
  for (const int views : groups) {
    const int long_gap = std::min(kLongGap, views - 1);
    AddPairs(begin, views, kShortGap, false, &short_pairs);
    if (long_gap > kShortGap) AddPairs(begin, views, long_gap, true, &long_pairs);
    begin += views;
  }
  std::vector<ViewPair> pairs = PickEvenly(short_pairs, static_cast<size_t>(most));
  for (const ViewPair& pair : PickEvenly(long_pairs, static_cast<size_t>(most))) {
    pairs.push_back(pair);
  }
  std::sort(pairs.begin(), pairs.end(), [](const ViewPair& x, const ViewPair& y) {
    return x.first != y.first ? x.first < y.first : x.second < y.second;
  });
  return pairs;
}

void ConsistencyMeter::Add(const ViewPair& pair, const PairDifference& difference) {
  if (difference.matches == 0) return;
  const auto count = static_cast<double>(difference.matches);
  absolute_ += count * difference.absolute_rgb;
  delta_e00_ += count * difference.delta_e00;
  matches_ += difference.matches;
  squared_[pair.long_gap ? 1 : 0] += difference.squared_rgb;
  ++pairs_[pair.long_gap ? 1 : 0];
}

Consistency ConsistencyMeter::Result() const {
  Consistency c;
  c.pairs = pairs_[0] + pairs_[1];
  c.matches = matches_;
  if (matches_ > 0) {
    c.me = absolute_ / static_cast<double>(matches_);
    c.me_de00 = delta_e00_ / static_cast<double>(matches_);
  }
  if (pairs_[0] > 0) c.tc_short = squared_[0] / pairs_[0];
  if (pairs_[1] > 0) c.tc_long = squared_[1] / pairs_[1];
  if (pairs_[0] == 0) c.tc = c.tc_long;
  if (pairs_[1] == 0) c.tc = c.tc_short;
  if (pairs_[0] > 0 && pairs_[1] > 0) c.tc = 0.5 * (c.tc_short + c.tc_long);
  return c;
}

}  // namespace color3d
