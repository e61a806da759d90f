#include "core/colorizer/model/padding.h"

#include <torch/types.h>

#include "core/encoder/image_tensors.h"

namespace color3d {

torch::Tensor PadToMultiple(const torch::Tensor& x, int multiple) {
  const int64_t right = (multiple - x.size(3) % multiple) % multiple;
  const int64_t bottom = (multiple - x.size(2) % multiple) % multiple;
  if (right == 0 && bottom == 0) return x;
  const bool can_reflect = right < x.size(3) && bottom < x.size(2);
  return can_reflect ? torch::reflection_pad2d(x, {0, right, 0, bottom})
                     : PadByReplication(x, multiple);
}

}  // namespace color3d
