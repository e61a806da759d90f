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
  std::vector<std::string> unplaced;  // names of the other photos
  SfmReport report;
};

// Photos of a place, or frames of films in their order: those are matched with their neighbours, at
// distances of 1 to 16, and with what other cameras saw alike; all pairs are never tried.
enum class PhotoOrder { kAny, kSequence };

// `photos` have been probed and are at least 2. Reduced 8-bit grey copies, COLMAP's database and
// sfm.log are left in `scratch_folder`. Matches planned pairs, then the photos that found no place
// with all. While fewer than nine tenths of the photos find a place, tries a straight lens and a
// small first angle; then, with coarse features and not very many photos, all pairs of fine ones.
// While fewer than half find a place: all pairs in any case, and loose thresholds last. Models with
// too few points or an absurd lens do not count. Throws Error: photos that were all taken from one
// place, which is found out first, fewer than 3 placed (kInvalidArgument), COLMAP not installed
// (kFailedPrecondition), too slow (kDeadlineExceeded), cancelled.
SfmResult RunStructureFromMotion(const std::vector<Photo>& photos,
                                 const std::filesystem::path& scene_folder,
                                 const std::filesystem::path& scratch_folder,
                                 const ImportOptions& options,
                                 const RunControl& run,
                                 PhotoOrder order = PhotoOrder::kAny);

}  // namespace color3d
