// Colour of one view carried into another through geometry (METHOD.md "Stage 2", "Reading order"):
// rendered depth tells where the surface behind each pixel lies in the source picture, depth and
// luminance tell whether the source sees the same thing. Pure functions, thread-safe.
#pragma once

#include "core/base/image.h"
#include "core/scene/camera.h"

namespace color3d {

// What is known of a view without colour. All pictures have the size of `camera`.
struct SurfaceView {
  Camera camera;
  Pose cam_from_world;
  Image luminance;  // 1 channel, L 0..100
  Image depth;      // 1 channel, scene units; 0: nothing there
};

struct CarryOptions {
  // Depth of the surface against the source's depth there, relative, 1e-4..1: confidence falls to
  // 1/e.
  double depth_tolerance = 0.03;
  // Difference of the mean L of a small window, L units, 1..100: confidence falls to 1/e.
  double luminance_tolerance = 20.0;
  // What is left of the window's structure, as a share of it: confidence falls to 1/e.
  double structure_tolerance = 0.7;
  // Registration by optical flow on top of geometry: displacement at which confidence falls to
  // 1/e, 0.1..10; 0: no registration.
  double flow_tolerance_px = 4.0;
  void Validate() const;
  bool operator==(const CarryOptions&) const = default;
};

struct CarriedColor {
  Image ab;          // 2 channels, Lab units; 0 where nothing was carried
  Image confidence;  // 1 channel, 0..1
};

// `ab`: 2 channels, and `confidence` (1 channel 0..1, or empty: 1 everywhere), of the source view.
CarriedColor CarryColor(const SurfaceView& source,
                        const Image& ab,
                        const Image& confidence,
                        const SurfaceView& target,
                        const CarryOptions& options);

// Takes `other` where `color` is less sure: per pixel the surer of two attempts at the same source.
void TakeSurer(const CarriedColor& other, CarriedColor* color);
// Adds a source of lower rank: its colours count only as far as `color` leaves room, so that two
// sources never average.
void FillFrom(const CarriedColor& other, CarriedColor* color);
// Share of the pixels of confidence above `least`.
double Coverage(const CarriedColor& color, float least);

}  // namespace color3d
