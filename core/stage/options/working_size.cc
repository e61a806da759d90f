#include "core/stage/options/working_size.h"

#include "core/base/error.h"

namespace color3d {

void CheckMaxSide(int max_side_px) {
  if (max_side_px < 64 || max_side_px > 4096) {
    throw InvalidArgument("max_side_px is {}; it must be 64 to 4096", max_side_px);
  }
}

}  // namespace color3d
