#include "core/augment/surrogates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/augment/depth_filter.h"
#include "core/augment/flow_frame.h"
#include "core/augment/orbit.h"
#include "core/augment/outpaint.h"

namespace color3d {
namespace {

constexpr float kMinOpacity = 0.6f;    // minimum opacity for a valid depth
constexpr double kMinCoverage = 0.25;  // minimum coverage of a picture by the key view
// Camera motion of the film frame, in median depths.
constexpr double kDriftAside = 0.05;
constexpr double kDriftForward = 0.04;

double UpperMedian(std::vector<float> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Image SolidDepth(const RenderedGeometry& seen) {
  Image depth = seen.depth;
  for (size_t i = 0; i < depth.PlaneSize(); ++i) {
    if (!(seen.opacity.data[i] >= kMinOpacity)) depth.data[i] = 0.0f;
  }
  return SmoothDepth(depth);
}

double Mean(const Image& image) {
  double sum = 0.0;
  for (const float value : image.data) sum += value;
  return sum / static_cast<double>(std::max<size_t>(1, image.data.size()));
}

}  // namespace

Surrogates::Surrogates(const KeyPicture& key,
                       const Scene& scene,
                       int key_index,
                       GeometryRenderer render,
                       uint64_t seed,
                       const CancellationToken& cancel)
    : key_(key), render_(std::move(render)), seed_(seed), cancel_(cancel) {
  if (!render_) return;
  const RenderedGeometry seen = render_(key.camera, key.cam_from_world);
  depth_view_ = {key.lab, SolidDepth(seen), key.camera, key.cam_from_world};
  std::vector<float> depths;
  for (const float depth : depth_view_.depth.data) {
    if (depth > 0.0f) depths.push_back(depth);
  }
  if (2 * depths.size() < depth_view_.depth.PlaneSize()) return;
  median_depth_ = UpperMedian(std::move(depths));
  center_ = CenterOfAttention(scene, key_index, median_depth_);
  angle_ = OrbitAngle(scene, key_index, center_);
}

std::string Surrogates::Obstacle(AugmentationKind kind) const {
  const int width = key_.lab.width, height = key_.lab.height;
  if (std::min(width, height) < kMinGeneratedSidePx) {
    return fmt::format("the key view is too small ({}x{} px)", width, height);
  }
  if (kind != AugmentationKind::kNovelView || median_depth_ > 0.0) return "";
  return render_ ? "the geometry fills less than half of the key view"
                 : "no luminance geometry among the inputs";
}

std::optional<GeneratedPicture> Surrogates::Make(AugmentationKind kind, int index) const {
  GeneratedPicture made;
  switch (kind) {
    case AugmentationKind::kOutpaint:
      made = OutpaintQuadrant(key_.lab,
                              static_cast<Quadrant>(index % 4),
                              seed_ + static_cast<uint64_t>(index / 4),
                              cancel_);
      break;
    case AugmentationKind::kAnimate:
      made = Animate(index);
      break;
    case AugmentationKind::kNovelView:
      made = NovelView(index);
      break;
  }
  if (Mean(made.weight) < kMinCoverage) return std::nullopt;
  return made;
}

GeneratedPicture Surrogates::Warp(const Pose& target) const {
  RenderedGeometry seen = render_(key_.camera, target);
  TargetGeometry geometry;
  geometry.depth = SolidDepth(seen);
  geometry.luminance = std::move(seen.luminance);
  return WarpToView(depth_view_, target, geometry);
}

GeneratedPicture Surrogates::Animate(int index) const {
  if (!(median_depth_ > 0.0)) return FlowFrame(key_.lab, seed_ + static_cast<uint64_t>(index));
  const double aside = (index % 2 == 0 ? kDriftAside : -kDriftAside) * (1 + index / 2);
  Pose drifted = key_.cam_from_world;
  drifted.translation -=
      median_depth_ * Eigen::Vector3d(aside, 0.0, kDriftForward * (1 + index / 2));
  return Warp(drifted);
}

GeneratedPicture Surrogates::NovelView(int index) const {
  // Right, left, above; then around the key view by the golden angle.
  constexpr double kGoldenAngle = 2.399963;
  const double turn = kGoldenAngle * index;
  double azimuth = angle_ * std::cos(turn), elevation = 0.6 * angle_ * std::sin(turn);
  if (index < 3) {
    azimuth = index == 0 ? angle_ : index == 1 ? -angle_ : 0.0;
    elevation = index == 2 ? 0.6 * angle_ : 0.0;
  }
  return Warp(OrbitPose(key_.cam_from_world, center_, azimuth, elevation));
}

}  // namespace color3d
