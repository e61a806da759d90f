// The loss of a training picture in the colours that are trained on, with masks. Internal to the
// splat module. Not thread-safe.
#pragma once

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/model/color_layout.h"
#include "core/splat/training/lab_loss.h"
#include "core/splat/training/loss.h"

namespace color3d {

struct PictureLossValue {
  double total = 0.0;
  double l1 = 0.0;  // mean |x - y|; in Lab, of a' and b' alone
};

class PictureLoss {
 public:
  PictureLoss(const GeometryOptions& options, const ColorLayout& layout);

  // Computes the loss and its gradient. `mask` (may be null): 1 where pixels count. Masked pixels
  // are set to the render, so that they have no loss, not even in windows that cross the mask's
  // edge, and no gradient.
  PictureLossValue Evaluate(const PlaneBuffer& drawn,
                            const PlaneBuffer& target,
                            const PlaneBuffer* mask,
                            ThreadPool& pool,
                            PlaneBuffer& gradient);
  // For other comparisons, with its work space.
  ImageLoss& image_loss() { return image_; }

 private:
  LossWeights weights_;
  bool lab_;
  ImageLoss image_;  // of all channels alike
  LabLoss lab_loss_;
  PlaneBuffer masked_target_;
};

}  // namespace color3d
