// Features of a network on a grid over a picture: distances between matched surfaces, and maps of
// principal components. Pure functions and values.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/image.h"
#include "core/metrics/consistency.h"

namespace color3d {

struct FeatureMap {
  Image values;            // a channel for each feature
  double stride_px = 1.0;  // pixels of the picture per cell
};

// Features at a point of the picture, px with pixel centres at +0.5, interpolated.
std::vector<float> FeaturesAt(const FeatureMap& map, double x, double y);

// Mean Euclidean distances.
struct FeatureDistance {
  int64_t places = 0;
  double matched = 0.0;    // of the two views of one surface
  double unmatched = 0.0;  // of views of different surfaces
  // 0: a surface has the same features in both views; 1: no more alike than any two surfaces.
  double Ratio() const { return unmatched > 0.0 ? matched / unmatched : 0.0; }
};

// Accumulates pairs of views. A plain value.
class FeatureDistanceMeter {
 public:
  // Each match is also compared with a random other one, as a different surface. Ignores fewer
  // than two matches.
  void Add(const FeatureMap& from, const FeatureMap& to, const std::vector<PixelMatch>& matches);
  FeatureDistance Result() const;

 private:
  int64_t places_ = 0;
  double matched_ = 0.0;
  double unmatched_ = 0.0;
};

// Pictures (sRGB, of each map's size) of the first three principal components over all maps as
// red, green and blue, from the 2nd to the 98th percentile. Similar features have similar colours
// in all of them. Components without variance are grey. Requires: equal numbers of channels.
std::vector<Image> PrincipalMaps(const std::vector<const Image*>& features);

}  // namespace color3d
