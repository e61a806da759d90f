// Features of photos and their matches: COLMAP's commands before the mapper. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/import_options.h"
#include "core/scene/sfm/colmap_process.h"
#include "core/scene/sfm/pair_planner.h"
#include "core/scene/sfm/sfm_photos.h"

namespace color3d {

// Files of one run.
struct SfmWorkspace {
  std::filesystem::path folder;
  std::filesystem::path images() const { return folder / "photos"; }
  std::filesystem::path masks() const { return folder / "photo_masks"; }
  std::filesystem::path database() const { return folder / "database.db"; }
};

// Coarse: without the octave of enlarged photos, which takes three quarters of the time and whose
// features are less repeatable. Small photos need it and are always fine.
enum class FeatureDetail { kCoarse, kFine };

// Extracts SIFT features of all photos into a new database, which numbers them by name. Photos of
// one folder share a camera. Returns true if some got coarse features.
bool ExtractFeatures(ColmapProcess& colmap,
                     const SfmWorkspace& work,
                     const FeatureImages& photos,
                     const ImportOptions& options,
                     FeatureDetail detail);

// Matches and verifies the pairs that the database lacks. Deterministic for the same photos and
// pairs, regardless of the number of threads, unlike COLMAP's own matcher (its feature trees are
// random).
void MatchPairs(ColmapProcess& colmap,
                const SfmWorkspace& work,
                const FeatureImages& photos,
                const std::vector<PhotoPair>& pairs,
                const RunControl& run);

}  // namespace color3d
