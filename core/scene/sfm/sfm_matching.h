// Features of photos and matches between them: COLMAP's programs up to the mapper. For this folder
// only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/import_options.h"
#include "core/scene/sfm/colmap_process.h"
#include "core/scene/sfm/pair_planner.h"
#include "core/scene/sfm/sfm_photos.h"

namespace color3d {

// Where one run keeps its files.
struct SfmWorkspace {
  std::filesystem::path folder;
  std::filesystem::path images() const { return folder / "photos"; }
  std::filesystem::path masks() const { return folder / "photo_masks"; }
  std::filesystem::path database() const { return folder / "database.db"; }
};

// Coarse: without the octave of enlarged photos, which costs three quarters of the time and whose
// features repeat less well. Small photos need it, so they are always fine.
enum class FeatureDetail { kCoarse, kFine };

// SIFT of all photos into a new database, which numbers them by name. Photos of one folder share a
// camera. True when some got coarse features.
bool ExtractFeatures(ColmapProcess& colmap,
                     const SfmWorkspace& work,
                     const FeatureImages& photos,
                     const ImportOptions& options,
                     FeatureDetail detail);

// Matches and verifies what the database does not hold yet. The same photos and pairs always give
// the same matches, whatever the number of threads: COLMAP's own matcher does not (its trees of
// features are random).
void MatchPairs(ColmapProcess& colmap,
                const SfmWorkspace& work,
                const FeatureImages& photos,
                const std::vector<PhotoPair>& pairs,
                const RunControl& run);

}  // namespace color3d
