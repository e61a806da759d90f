#include "core/scene/import_options.h"

#include "core/base/range_check.h"

namespace color3d {

void ImportOptions::Validate() const {
  const RangeCheck check("import option");
  check("sfm_max_image_side_px", sfm_max_image_side_px, 256, 4096);
  check("sfm_max_features", sfm_max_features, 512, 16384);
  check("sfm_neighbors", sfm_neighbors, 2, 100);
  check("hold_out_block", hold_out_block, 0.0, 0.5);
  check("sfm_timeout", sfm_timeout.count(), 1, 7 * 24 * 3600);
}

}  // namespace color3d
