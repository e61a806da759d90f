// The loss of a picture in Lab, L_l + L_ab (GAUSSIANS.md "Losses"): L' has the edge term, a' and b'
// have not. Not thread-safe; keeps its work space between calls.
#pragma once

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/training/loss.h"

namespace color3d {

struct LabLossValue {
  LossValue l;
  LossValue ab;  // mean over both channels
  double total() const { return l.total + ab.total; }
};

class LabLoss {
 public:
  // As ImageLoss::Evaluate, for L', a', b'. The weight of the edge term is that of L'.
  LabLossValue Evaluate(const PlaneBuffer& drawn,
                        const PlaneBuffer& target,
                        const PlaneBuffer* pixel_weight,
                        const LossWeights& weights,
                        ThreadPool& pool,
                        PlaneBuffer& gradient);

 private:
  // Work space of L', and of a' and b'.
  struct Part {
    ImageLoss loss;
    PlaneBuffer drawn;
    PlaneBuffer target;
    PlaneBuffer gradient;
  };
  Part l_;
  Part ab_;
};

}  // namespace color3d
