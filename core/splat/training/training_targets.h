// Training pictures in the kernels' form, cached within a byte budget. The first ones are kept,
// which is as good as any other policy for a random order of access; pictures of other levels are
// evicted first. Internal to the splat module. Not thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include "core/base/image.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/training/posed_camera.h"

namespace color3d {

// Returns a picture of the size of the view's camera, or null.
using PictureSource = std::function<std::shared_ptr<const Image>(int view)>;

// Planes with value = (sample + offset) * scale.
PlaneBuffer PlanesFromImage(const Image& image, float offset, float scale);

// Size at a level: 2^-level of the full size, at least 1 px.
int SizeAtLevel(int size_px, int level);

class TrainingTargets {
 public:
  using Reduce = std::function<Image(const Image& image, int width, int height)>;
  // `source` returns `channels` channels, must outlive this object, and is multiplied by `scale`.
  // `reduce` shrinks a picture; empty: Resize.
  TrainingTargets(const PictureSource& source,
                  int channels,
                  float scale,
                  int64_t budget_bytes,
                  Reduce reduce = {})
      : source_(source),
        channels_(channels),
        scale_(scale),
        budget_bytes_(budget_bytes),
        reduce_(std::move(reduce)) {}

  // Returns the picture of a view at a level, or null if the source has none. Throws
  // Error{kInvalidArgument} if the picture's size differs from the camera's.
  std::shared_ptr<const PlaneBuffer> Get(const PosedCamera& view, int level);
  int64_t kept_bytes() const { return kept_bytes_; }  // at most the budget

 private:
  void Keep(int view, int level, const std::shared_ptr<const PlaneBuffer>& planes);

  const PictureSource& source_;
  int channels_;
  float scale_;
  int64_t budget_bytes_;
  Reduce reduce_;
  int64_t kept_bytes_ = 0;
  std::map<std::pair<int, int>, std::shared_ptr<const PlaneBuffer>> kept_;
};

}  // namespace color3d
