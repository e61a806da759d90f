// Work of a stage, and its expected seconds. Plans, time budgets and the report share it. Pure
// functions, thread-safe.
#pragma once

#include <string_view>

#include "core/catalogue/captures.h"

namespace color3d {

// Work of one stage. Fields that a stage does not depend on are ignored.
struct StageWork {
  int views = 0;            // photos or frames
  double megapixels = 0.0;  // of one picture at the working size
  int iterations = 0;       // of training
  int gaussians = 0;        // maximum number
  int sh_degree = 0;        // of their luminance
  CaptureKind kind = CaptureKind::kStatic;
  bool estimates_poses = false;
  bool geometry_given = false;  // the scene is a splat
  bool key_view_given = false;
  bool ends_early = false;  // personalization stops where its error no longer falls
  bool paper_recipe = false;
  bool trains_jointly = false;  // chroma is trained together with the geometry
};

// Megapixels of a picture whose longer side is `max_side_px`. The aspect is unknown before import:
// 4:3 is assumed for photos, 16:9 for frames.
double AssumedMegapixels(int max_side_px, bool is_frame);

// Seconds of computing on two cores of an EPYC with AVX-512 (tests/bench/RESULTS.md).
// 0 for kinds that take no time of their own. Throws Error{kInternal} if there is no such kind.
double EstimateSeconds(std::string_view stage, const StageWork& work);

}  // namespace color3d
