// Plane sweep and carrying on a textured plane whose depth is known.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/carry/carry.h"
#include "core/carry/plane_sweep.h"
#include "tests/stability/tiny_problem.h"
#include "tests/support/scenes/textured_corner.h"

namespace color3d {
namespace {

const Camera kCamera{96, 72, 90.0, 90.0, 48.0, 36.0};
constexpr double kNear = 2.0, kFar = 8.0, kDepth = 4.0;
constexpr double kStepInDepth = kDepth * (1.0 / kNear - 1.0 / kFar) / 95.0;  // of 96 planes

Pose MovedBy(double x, double z = 0.0) {
  Pose pose;
  pose.translation = {-x, 0.0, -z};
  return pose;
}

// A fronto-parallel plane at `depth`, seen from `pose`: L in 0..100. `contrast`: 0..1.
Image PlaneLuminance(const Pose& pose, double depth, double contrast = 1.0) {
  Image l(kCamera.width, kCamera.height, 1);
  const Eigen::Vector3d from = pose.Center();
  for (int y = 0; y < l.height; ++y) {
    for (int x = 0; x < l.width; ++x) {
      const Eigen::Vector3d ray = kCamera.Ray(x + 0.5, y + 0.5);
      const Eigen::Vector3d hit = from + ray * ((depth - from.z()) / ray.z());
      const double texture = CornerTexture(hit.x() * 4.0 / depth, hit.y() * 4.0 / depth, 1);
      l.At(0, y, x) = static_cast<float>(50.0 + contrast * (100.0 * texture - 50.0));
    }
  }
  return l;
}

struct Sweep {
  double baseline = 0.4;
  double depth = kDepth;
  double contrast = 1.0;
  double nearest = kNear;
  double farthest = kFar;
  bool source_black = false;
  double bound = kNotCompared;  // of the median relative error of depth; NaN: not determined
};

StabilityResult RunSweep(const Sweep& s) {
  const Pose here = MovedBy(0.0), there = MovedBy(s.baseline);
  const Image reference = PlaneLuminance(here, s.depth, s.contrast);
  const Image source = s.source_black ? Image(kCamera.width, kCamera.height, 1)
                                      : PlaneLuminance(there, s.depth, s.contrast);
  const Image depth = SweepPlanes({kCamera, here, &reference},
                                  {{kCamera, there, &source}},
                                  s.nearest,
                                  s.farthest,
                                  PlaneSweepOptions(),
                                  CancellationToken());
  StabilityResult r;
  // Relative change of depth per pixel of disparity.
  r.condition = s.baseline > 0.0 ? s.depth / (kCamera.fx * s.baseline) : HUGE_VAL;
  r.condition_of = "depth, per pixel";
  r.non_finite = CountNonFinite(depth.data.data(), depth.data.size());
  r.compared = static_cast<int64_t>(depth.data.size());
  std::vector<double> errors;
  int64_t outside = 0;
  for (const float d : depth.data) {
    outside += d < s.nearest * (1.0 - 1e-5) || d > s.farthest * (1.0 + 1e-5) ? 1 : 0;
    errors.push_back(std::abs(d - s.depth) / s.depth);
  }
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  const double median = errors[errors.size() / 2];
  r.held = outside == 0;
  if (std::isnan(s.bound)) {
    r.outcome = "any depth in the range is right";
  } else {
    r.value_error = median;
    r.value_bound = s.bound;
  }
  return r;
}

// A red plane seen from two cameras; parts of the pictures are changed by the case.
struct Carry {
  SurfaceView source, target;
  Image ab, confidence;
  explicit Carry(double baseline) {
    const auto view = [](const Pose& pose) {
      return SurfaceView{kCamera,
                         pose,
                         PlaneLuminance(pose, kDepth),
                         Image(kCamera.width, kCamera.height, 1, static_cast<float>(kDepth))};
    };
    source = view(MovedBy(0.0));
    target = view(MovedBy(baseline));
    ab = Image(kCamera.width, kCamera.height, 2);
    std::fill_n(ab.Plane(0), ab.PlaneSize(), 50.0f);
    std::fill_n(ab.Plane(1), ab.PlaneSize(), 30.0f);
  }
};

// The carried colour is that of the plane, where any is carried. `least` and `most`: bounds of the
// share of pixels with a confidence above 0.3.
StabilityResult RunCarry(const Carry& c, double least, double most) {
  const CarriedColor carried = CarryColor(c.source, c.ab, c.confidence, c.target, CarryOptions());
  StabilityResult r;
  r.condition_of = "-";
  r.non_finite = CountNonFinite(carried.ab.data.data(), carried.ab.data.size()) +
                 CountNonFinite(carried.confidence.data.data(), carried.confidence.data.size());
  r.compared = static_cast<int64_t>(carried.confidence.data.size());
  double error = 0.0;
  bool in_range = true;
  for (size_t i = 0; i < carried.confidence.data.size(); ++i) {
    const float confidence = carried.confidence.data[i];
    in_range = in_range && confidence >= 0.0f && confidence <= 1.0f;
    if (confidence <= 0.0f) continue;
    const size_t plane = carried.ab.PlaneSize();
    error = std::max({error,
                      std::abs(carried.ab.data[i] - 50.0) / 50.0,
                      std::abs(carried.ab.data[plane + i] - 30.0) / 50.0});
  }
  r.value_error = error;
  r.value_bound = 1e-5;
  const double share = Coverage(carried, 0.3f);
  r.held = in_range && share >= least && share <= most;
  char text[60];
  std::snprintf(text, sizeof(text), "%.0f %% carried", 100.0 * share);
  r.outcome = text;
  return r;
}

}  // namespace

void AddCarryCases(std::vector<StabilityCase>& cases) {
  const auto sweep = [&](const std::string& name, const Sweep& s) {
    cases.push_back({"sweep", name, false, [s](ThreadPool&) { return RunSweep(s); }});
  };
  // One plane of the sweep, or one pixel of disparity.
  sweep("ordinary baseline", {.bound = 2.0 * kStepInDepth});
  sweep("baseline of a pixel of disparity", {.baseline = kDepth / 90.0, .bound = 0.5});
  sweep("baseline of 1e-6", {.baseline = 1e-6});
  sweep("no baseline", {.baseline = 0.0});
  sweep("no texture", {.contrast = 0.0});
  sweep("contrast of 0.1 L", {.contrast = 1e-3, .bound = 4.0 * kStepInDepth});
  sweep("a black source", {.source_black = true});
  sweep("the plane a million units away",
        {.baseline = 1e5, .depth = 1e6, .nearest = 5e5, .farthest = 2e6, .bound = 0.03});
  sweep("depths from 1e-3 to 1e6", {.nearest = 1e-3, .farthest = 1e6});

  const auto carry = [&](const std::string& name, double least, double most, auto make) {
    cases.push_back(
        {"carry", name, false, [=](ThreadPool&) { return RunCarry(make(), least, most); }});
  };
  carry("the same camera", 0.99, 1.0, [] { return Carry(0.0); });
  carry("an ordinary baseline", 0.7, 1.0, [] { return Carry(0.4); });
  carry("no overlap", 0.0, 0.0, [] { return Carry(50.0); });
  carry("no surface in the target", 0.0, 0.0, [] {
    Carry c(0.4);
    c.target.depth = Image(kCamera.width, kCamera.height, 1);
    return c;
  });
  carry("target depths of 1e30", 0.0, 0.0, [] {
    Carry c(0.4);
    c.target.depth = Image(kCamera.width, kCamera.height, 1, 1e30f);
    return c;
  });
  carry("target depths of 1e-30", 0.0, 0.0, [] {
    Carry c(0.4);
    c.target.depth = Image(kCamera.width, kCamera.height, 1, 1e-30f);
    return c;
  });
  carry("the source sees something in front", 0.0, 0.02, [] {
    Carry c(0.4);
    c.source.depth = Image(kCamera.width, kCamera.height, 1, 1.0f);
    return c;
  });
  carry("the target behind the source", 0.0, 0.0, [] {
    Carry c(0.0);
    c.target.cam_from_world.rotation = Eigen::AngleAxisd(3.14159265, Eigen::Vector3d::UnitY());
    return c;
  });
  carry("confidence of 0 in the source", 0.0, 0.0, [] {
    Carry c(0.0);
    c.confidence = Image(kCamera.width, kCamera.height, 1);
    return c;
  });
  carry("both pictures constant", 0.0, 1.0, [] {
    Carry c(0.4);
    c.source.luminance = c.target.luminance = Image(kCamera.width, kCamera.height, 1, 50.0f);
    return c;
  });
}

}  // namespace color3d
