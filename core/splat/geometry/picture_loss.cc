#include "core/splat/geometry/picture_loss.h"

#include "core/splat/geometry/held_out.h"

namespace color3d {

PictureLoss::PictureLoss(const GeometryOptions& options, const ColorLayout& layout)
    : lab_(layout.space == ColorSpace::kLab && layout.channels == 3) {
  weights_.ssim = static_cast<float>(options.ssim_weight);
  weights_.l1 = 1.0f - weights_.ssim;
  weights_.edge = static_cast<float>(options.edge_weight);
}

PictureLossValue PictureLoss::Evaluate(const PlaneBuffer& drawn,
                                       const PlaneBuffer& target,
                                       const PlaneBuffer* mask,
                                       ThreadPool& pool,
                                       PlaneBuffer& gradient) {
  const PlaneBuffer* compared = &target;
  if (mask != nullptr) {
    masked_target_ = target;
    CopyMasked(*mask, drawn, masked_target_);
    compared = &masked_target_;
  }
  PictureLossValue value;
  if (lab_) {
    const LabLossValue loss = lab_loss_.Evaluate(drawn, *compared, mask, weights_, pool, gradient);
    value = {loss.total(), loss.ab.l1};
  } else {
    const LossValue loss = image_.Evaluate(drawn, *compared, mask, weights_, pool, gradient);
    value = {loss.total, loss.l1};
  }
  if (mask != nullptr) ZeroMasked(*mask, gradient);
  return value;
}

}  // namespace color3d
