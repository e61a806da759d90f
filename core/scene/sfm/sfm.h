// Structure-from-motion: COLMAP 3.8 as child processes on the CPU, without a display. For this
// folder only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/run_control.h"
#include "core/scene/import_options.h"
#include "core/scene/photos.h"

namespace color3d {

struct SfmResult {
  Scene scene;  // the views that were placed, with their points; cameras at the photos' full size
  SfmReport report;
};

// kAny: photos of a place. kSequence: consecutive frames of films, matched with their neighbours at
// distances of 1 to 16 and with similar frames of other cameras; all pairs are never tried.
enum class PhotoOrder { kAny, kSequence };

// Requires: at least 2 `photos`, probed. Leaves reduced 8-bit grey copies, COLMAP's database and
// sfm.log in `scratch_folder`. Matches planned pairs, then the unregistered photos with all others.
// While fewer than nine tenths are registered, tries a straight lens and a smaller initial angle;
// then, with coarse features and not too many photos, all pairs of fine features. While fewer than
// half are registered, tries all pairs in any case, and loose thresholds last. Models with too few
// points or an absurd lens are rejected. Throws Error: photos taken from one place (detected
// first), fewer than 3 registered (kInvalidArgument), COLMAP not installed (kFailedPrecondition),
// too slow (kDeadlineExceeded), cancelled.
SfmResult RunStructureFromMotion(const std::vector<Photo>& photos,
                                 const std::filesystem::path& scene_folder,
                                 const std::filesystem::path& scratch_folder,
                                 const ImportOptions& options,
                                 const RunControl& run,
                                 PhotoOrder order = PhotoOrder::kAny);

}  // namespace color3d
