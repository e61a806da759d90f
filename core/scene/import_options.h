// Options of importing a scene, and what structure-from-motion reports.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

namespace color3d {

// Which pairs of photos structure-from-motion matches: a planned few, with all as the way out when
// those do not hang together, or all from the start.
enum class SfmPairs { kPlanned, kExhaustive };

struct ImportOptions {
  // Hold out every eighth view for evaluation: HoldOutEveryEighth.
  bool hold_out_every_eighth = false;
  // Of a dynamic scene of several cameras: all views of this one, by its name or folder. Empty:
  // none.
  std::string hold_out_camera;
  // Of views with times: this share of the moments as one block, in the middle (import/hold_out.h).
  // 0: no.
  double hold_out_block = 0.0;  // 0..0.5
  // Structure-from-motion (only when the input has no poses).
  int sfm_max_image_side_px = 1600;  // 256..4096
  int sfm_max_features = 4096;       // 512..16384, per photo
  SfmPairs sfm_pairs = SfmPairs::kPlanned;
  int sfm_neighbors = 8;  // 2..100, similar photos that each photo is matched with
  std::chrono::seconds sfm_timeout{3600};
  // Photos that would take more than this as the key view are refused. 0: none are.
  int64_t memory_bytes = 0;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const ImportOptions&) const = default;
};

// What structure-from-motion did.
struct SfmReport {
  std::string plan;           // which pairs were matched and why, one line
  std::filesystem::path log;  // what COLMAP said, below the scratch folder
  int64_t pairs_tried = 0;
  bool exhaustive = false;  // all pairs were matched
  double photos_seconds = 0.0;
  double features_seconds = 0.0;
  double matching_seconds = 0.0;
  double mapping_seconds = 0.0;
};

}  // namespace color3d
