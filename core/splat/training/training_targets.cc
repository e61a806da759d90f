#include "core/splat/training/training_targets.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/image/codec.h"

namespace color3d {

PlaneBuffer PlanesFromImage(const Image& image, float offset, float scale) {
  PlaneBuffer planes(image.width, image.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < image.height; ++y) {
      const float* in = image.Plane(c) + static_cast<size_t>(y) * image.width;
      float* out = planes.Row(c, y);
      for (int x = 0; x < image.width; ++x) out[x] = (in[x] + offset) * scale;
    }
  }
  return planes;
}

namespace {

// Throws Error{kInvalidArgument} naming the first value that is not finite.
void CheckFinite(const Image& image, int view) {
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (std::isfinite(image.data[i])) continue;
    const size_t pixel = i % (static_cast<size_t>(image.width) * image.height);
    throw InvalidArgument(
        "view {}: the pixel at {}, {} is not a finite number; mend or leave out the photo",
        view,
        pixel % image.width,
        pixel / image.width);
  }
}

int64_t BytesOf(const PlaneBuffer& planes) {
  return static_cast<int64_t>(planes.data.size() * sizeof(float));
}

}  // namespace

int SizeAtLevel(int size_px, int level) {
  return std::max(1, (size_px + (1 << level) / 2) >> level);
}

std::shared_ptr<const PlaneBuffer> TrainingTargets::Get(const PosedCamera& view, int level) {
  const auto found = kept_.find({view.view, level});
  if (found != kept_.end()) return found->second;
  const std::shared_ptr<const Image> image = source_(view.view);
  if (image == nullptr) return nullptr;
  if (image->channels != channels_ || image->width != view.camera.width ||
      image->height != view.camera.height) {
    throw InvalidArgument("view {}: the picture is {}x{}x{}, its camera {}x{} px of {} channels",
                          view.view,
                          image->width,
                          image->height,
                          image->channels,
                          view.camera.width,
                          view.camera.height,
                          channels_);
  }
  CheckFinite(*image, view.view);
  const int width = SizeAtLevel(image->width, level), height = SizeAtLevel(image->height, level);
  const auto reduced = [&] {
    return reduce_ ? reduce_(*image, width, height) : Resize(*image, width, height);
  };
  auto planes = std::make_shared<const PlaneBuffer>(
      PlanesFromImage(level == 0 ? *image : reduced(), 0.0f, scale_));
  Keep(view.view, level, planes);
  return planes;
}

void TrainingTargets::Keep(int view, int level, const std::shared_ptr<const PlaneBuffer>& planes) {
  const int64_t bytes = BytesOf(*planes);
  for (auto other = kept_.begin(); other != kept_.end() && kept_bytes_ + bytes > budget_bytes_;) {
    if (other->first.second == level) {
      ++other;
      continue;
    }
    kept_bytes_ -= BytesOf(*other->second);
    other = kept_.erase(other);
  }
  if (kept_bytes_ + bytes > budget_bytes_) return;
  kept_bytes_ += bytes;
  kept_[{view, level}] = planes;
}

}  // namespace color3d
