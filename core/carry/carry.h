// Carries the colours of one view into another through geometry (GAUSSIANS.md "Stage 2", "Reading
// order"). Rendered depth gives the place of each pixel's surface in the source picture; depth and
// luminance decide whether the source sees the same surface. Pure functions, thread-safe.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/image.h"
#include "core/scene/camera.h"

namespace color3d {

// A view without colour. All pictures have the size of `camera`.
struct SurfaceView {
  Camera camera;
  Pose cam_from_world;
  Image luminance;  // 1 channel, L 0..100
  Image depth;      // 1 channel, scene units; 0: no surface
};

struct CarryOptions {
  // Relative difference between the depth of the surface and the source's depth at which confidence
  // falls to 1/e, 1e-4..1.
  double depth_tolerance = 0.03;
  // Difference of the mean L of a small window at which confidence falls to 1/e, 1..100.
  double luminance_tolerance = 20.0;
  // Residual of the window's structure, relative to the structure, at which confidence falls to
  // 1/e.
  double structure_tolerance = 0.7;
  // Displacement found by optical flow, after geometry, at which confidence falls to 1/e, 0.1..10;
  // 0: no registration by flow.
  double flow_tolerance_px = 4.0;
  void Validate() const;
  bool operator==(const CarryOptions&) const = default;
};

struct CarriedColor {
  // 2 channels, Lab units; 0 where nothing was carried. Further channels are carried like these.
  Image ab;
  Image confidence;  // 1 channel, 0..1
};

// `ab` (2 channels or more) and `confidence` (1 channel, 0..1; empty: 1 everywhere) are the source
// view's.
CarriedColor CarryColor(const SurfaceView& source,
                        const Image& ab,
                        const Image& confidence,
                        const SurfaceView& target,
                        const CarryOptions& options);

// The two below require equal sizes and channels.
// Replaces each pixel of `color` by that of `other` where `other` is more confident.
void KeepMoreConfident(const CarriedColor& other, CarriedColor* color);
// Adds a source of lower rank. Its confidence is multiplied by 1 - that of `color`, so that it
// fills gaps and does not change known colours.
void FillFrom(const CarriedColor& other, CarriedColor* color);
// Share of the pixels whose confidence is above `least`, 0..1.
double Coverage(const CarriedColor& color, float least);

// How well depth and luminance of a view agree with those of key views where they show the same
// surfaces. It is low when the geometry or the poses are wrong, or when surfaces look different
// from each side.
struct Agreement {
  double confidence_sum = 0.0;  // over the pixels with carried colours
  int64_t pixels = 0;
};

// `confidence`: of carried colours, 1 channel, 0..1.
Agreement AgreementOf(const Image& confidence);
// Mean match probability of the views' pixels with carried colours, 0..1; 1 without any.
double MeanAgreement(const std::vector<Agreement>& views);

}  // namespace color3d
