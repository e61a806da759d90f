// Options of importing a scene, and the report of structure-from-motion.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

namespace color3d {

// Pairs of photos that structure-from-motion matches: a planned subset, with all pairs as the
// fallback if they do not connect the photos; or all pairs from the start.
enum class SfmPairs { kPlanned, kExhaustive };

struct ImportOptions {
  // Hold out every eighth view for evaluation (HoldOutEveryEighth).
  bool hold_out_every_eighth = false;
  // Dynamic scenes of several cameras: hold out all views of this camera, by name or folder. Empty:
  // none.
  std::string hold_out_camera;
  // Views with times: hold out this share of the times as one block in the middle
  // (import/hold_out.h). 0: none.
  double hold_out_block = 0.0;  // 0..0.5
  // Structure-from-motion (only when the input has no poses).
  int sfm_max_image_side_px = 1600;  // 256..4096
  int sfm_max_features = 4096;       // 512..16384, per photo
  SfmPairs sfm_pairs = SfmPairs::kPlanned;
  int sfm_neighbors = 8;  // 2..100, similar photos that each photo is matched with
  std::chrono::seconds sfm_timeout{3600};
  // Photos that would need more memory than this as the key view are refused. 0: no limit.
  int64_t memory_bytes = 0;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const ImportOptions&) const = default;
};

// Report of structure-from-motion.
struct SfmReport {
  std::string plan;           // pairs that were matched, and why; one line
  std::filesystem::path log;  // COLMAP's output, below the scratch folder
  int64_t pairs_tried = 0;
  bool exhaustive = false;  // all pairs were matched
  double photos_seconds = 0.0;
  double features_seconds = 0.0;
  double matching_seconds = 0.0;
  double mapping_seconds = 0.0;
};

}  // namespace color3d
