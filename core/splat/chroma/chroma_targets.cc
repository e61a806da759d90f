#include "core/splat/chroma/chroma_targets.h"

#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/splat/training/training_targets.h"

namespace color3d {
namespace {

constexpr float kMaxChroma = 1000.0f;  // Lab units; real colours stay below 130
constexpr float kWeightSlack = 1e-3f;

std::string SizeOf(const Image& image) {
  return fmt::format("{}x{}x{}", image.width, image.height, image.channels);
}

void CheckSizes(const ChromaTarget& target, const PosedCamera& view) {
  const auto fits = [&](const Image& image, int channels) {
    return image.channels == channels && image.width == view.camera.width &&
           image.height == view.camera.height;
  };
  if (fits(target.ab, 2) && (target.weight.Empty() || fits(target.weight, 1)) &&
      (target.confidence.Empty() || fits(target.confidence, 1))) {
    return;
  }
  throw InvalidArgument(
      "chroma target of view {} is {}, its weight {}, its confidence {}; {}x{}x2 and the same size "
      "with one channel are needed",
      view.view,
      SizeOf(target.ab),
      SizeOf(target.weight),
      SizeOf(target.confidence),
      view.camera.width,
      view.camera.height);
}

// These comparisons are false for NaN.
void CheckValues(const Image& image, float low, float high, const char* what, int view) {
  for (int c = 0; c < image.channels; ++c) {
    const float* plane = image.Plane(c);
    for (size_t i = 0; i < image.PlaneSize(); ++i) {
      if (plane[i] >= low && plane[i] <= high) continue;
      throw InvalidArgument(
          "chroma target of view {}: {} at pixel ({}, {}) is {}; give a number from {} to {}",
          view,
          what,
          i % image.width,
          i / image.width,
          plane[i],
          std::lround(low),
          std::lround(high));
    }
  }
}

}  // namespace

bool LoadChromaPlanes(const ChromaProblem& problem, const PosedCamera& view, ChromaPlanes* planes) {
  const std::shared_ptr<const ChromaTarget> given = problem.targets(view.view);
  if (given == nullptr) return false;
  CheckSizes(*given, view);
  CheckValues(given->ab, -kMaxChroma, kMaxChroma, "chroma", view.view);
  CheckValues(given->weight, -kWeightSlack, 1.0f + kWeightSlack, "weight", view.view);
  CheckValues(given->confidence, 0.0f, 1.0f, "confidence", view.view);
  planes->ab = PlanesFromImage(given->ab, 0.0f, 1.0f / 255.0f);
  planes->weight =
      given->weight.Empty()
          ? PlanesFromImage(Image(given->ab.width, given->ab.height, 1, 1.0f), 0.0f, 1.0f)
          : PlanesFromImage(given->weight, 0.0f, 1.0f);
  planes->has_confidence = !given->confidence.Empty();
  planes->confidence = PlanesFromImage(
      planes->has_confidence ? given->confidence : Image(given->ab.width, given->ab.height, 1),
      0.0f,
      1.0f);
  return true;
}

std::shared_ptr<const ChromaPlanes> ChromaTargets::Get(const PosedCamera& view) {
  {
    const MutexLock lock(mutex_);
    const auto found = kept_.find(view.view);
    if (found != kept_.end()) return found->second;
  }
  auto planes = std::make_shared<ChromaPlanes>();
  if (!LoadChromaPlanes(problem_, view, planes.get())) return nullptr;
  planes->confidence = {};
  return planes;
}

void ChromaTargets::Offer(const PosedCamera& view, ChromaPlanes planes) {
  planes.confidence = {};
  const auto bytes =
      static_cast<int64_t>((planes.ab.data.size() + planes.weight.data.size()) * sizeof(float));
  const MutexLock lock(mutex_);
  if (kept_bytes_ + bytes > budget_bytes_) return;
  if (!kept_.emplace(view.view, std::make_shared<const ChromaPlanes>(std::move(planes))).second) {
    return;
  }
  kept_bytes_ += bytes;
}

int64_t ChromaTargets::kept_bytes() const {
  const MutexLock lock(mutex_);
  return kept_bytes_;
}

}  // namespace color3d
