// Edge-aware upsampling of coarse chroma, guided by L.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Defaults, chosen for the personalized colorizer: windows of 5 x 5 cells; contrasts of L below
// about sqrt(20) = 4.5 units are not edges.
inline constexpr int kGuideRadius = 2;               // cells
inline constexpr float kGuideVarianceFloor = 20.0f;  // L units squared

// Fast guided filter (He & Sun 2015): on the coarse grid, ab is fitted as a local linear function
// of L in windows of (2 radius + 1)^2 cells; the coefficients are interpolated bilinearly and
// applied to the full-size L. `ab`: any channels on a coarse grid whose cells tile the picture
// evenly; `luminance`: 1 channel, L 0..100. `variance_floor` (L units squared) decides below which
// contrast L is no edge. Returns ab's channels at luminance's size.
Image UpsampleGuided(const Image& ab,
                     const Image& luminance,
                     int radius = kGuideRadius,
                     float variance_floor = kGuideVarianceFloor);

}  // namespace color3d
