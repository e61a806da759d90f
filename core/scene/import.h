// From a folder of files to a posed Scene: finds what kind of input it is, reads poses or runs
// structure-from-motion, undistorts cameras, and checks everything at the door.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/run_control.h"
#include "core/scene/scene.h"

namespace color3d {

enum class SceneLayout {
  kPhotos,
  kColmap,
  kTransforms,
  kNerfies,
  kPosesBounds,
  kPosedFilms,
  kFilms
};

// Which pairs of photos structure-from-motion matches: a planned few, with all as the way out when
// those do not hang together, or all from the start.
enum class SfmPairs { kPlanned, kExhaustive };

struct ImportOptions {
  // Hold out every eighth view for evaluation: HoldOutEveryEighth.
  bool hold_out_every_eighth = false;
  // Of a dynamic scene of several cameras: all views of this one, by its name or folder. Empty:
  // none.
  std::string hold_out_camera;
  // Of views with times: this share of the moments as one block, in the middle (held_out.h). 0: no.
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

struct ImportResult {
  Scene scene;
  SceneLayout layout = SceneLayout::kPhotos;
  bool ran_structure_from_motion = false;
  SfmReport sfm;               // when it ran
  bool undistorted = false;    // some camera had lens distortion
  bool random_points = false;  // the input had none
  int photos_found = 0;
  int photos_registered = 0;
  int masked_views = 0;               // of which parts are masked out
  std::vector<std::string> cameras;   // of a dynamic scene: names by Moment::shot
  std::vector<std::string> warnings;  // for the report; not sent to the observer
};

// `scene_folder` holds photos (directly or in images/), perhaps with COLMAP models
// (catalogue/pose_files.h says where; text or binary) and times.txt, or with transforms.json (or
// Blender's transforms_train.json, ...), or with LLFF's poses_bounds.npy; or what Nerfies and
// HyperNeRF have (metadata.json, camera/, rgb/). Of several models and kinds of poses the one is
// used that places most photos, COLMAP's where others place no more, and which one is said; a
// times.txt without a COLMAP model is warned of. Structure-from-motion runs only where none of them
// can be used.
// `scratch_folder` receives structure-from-motion's files and sfm.log. Throws Error: an empty
// folder, one photo, unreadable photos, a model whose images are missing, masks that fit no photo
// (photo_masks.h), non-finite numbers, photos that do not overlap (how many registered and why it
// may have failed), points that all lie behind their cameras or absurdly far away. Scenes far from
// the origin are recentred, very small and very large ones rescaled (normalise.h); points with
// fewer than 2 observations are dropped; poses without points get 20 000 seeded random ones. Warns
// of cameras whose intrinsics do not fit their observations. Keeps no checkpoints.
ImportResult ImportScene(const std::filesystem::path& scene_folder,
                         const std::filesystem::path& scratch_folder,
                         const ImportOptions& options,
                         const RunControl& run);

// One of the pictures that a camera took one after the other. Both paths are absolute, or relative
// to the working directory.
struct SequenceFrame {
  std::string name;
  std::filesystem::path file;
  std::filesystem::path mask_file;  // what stands still (masks/photo_masks.h); empty: all of it
  int camera = 0;                   // each has a lens of its own
};

// Poses by structure-from-motion, as of photos, but each frame is matched with its neighbours and
// with the likest of other cameras only, and all pairs are never tried. The views have the frames'
// names, in their order; those that found no place are missing. image_file and mask_file are the
// paths given. What FinishPosedScene does is left to the caller. Throws Error as ImportScene.
ImportResult PlaceSequence(const std::vector<SequenceFrame>& frames,
                           const std::filesystem::path& scratch_folder,
                           const ImportOptions& options,
                           const RunControl& run);

// What ImportScene does to every scene once its views have poses: the checks, the coordinates, the
// points where there are none, what is held out.
void FinishPosedScene(const ImportOptions& options, ImportResult* result);

// Marks every eighth view as held out, beginning with the first; of a dynamic scene all views of
// every eighth moment, beginning with the fifth. Warns where the scene has too few.
void HoldOutEveryEighth(Scene* scene, std::vector<std::string>* warnings);

}  // namespace color3d
