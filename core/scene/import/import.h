// From a folder of files to a posed Scene: finds what kind of input it is, reads poses or runs
// structure-from-motion, undistorts cameras, and checks everything at the door.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/run_control.h"
#include "core/catalogue/captures.h"
#include "core/scene/import_options.h"
#include "core/scene/scene.h"

namespace color3d {

struct ImportResult {
  Scene scene;
  CaptureLayout layout = CaptureLayout::kPhotos;
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
// the origin are recentred, very small and very large ones rescaled (import/normalise.h); points
// with fewer than 2 observations are dropped; poses without points get 20 000 seeded random ones.
// Warns of cameras whose intrinsics do not fit their observations. Keeps no checkpoints.
ImportResult ImportScene(const std::filesystem::path& scene_folder,
                         const std::filesystem::path& scratch_folder,
                         const ImportOptions& options,
                         const RunControl& run);

// One of the pictures that a camera took one after the other. Both paths are absolute, or relative
// to the working directory.
struct SequenceFrame {
  std::string name;
  std::filesystem::path file;
  std::filesystem::path mask_file;  // what stands still (photo_masks.h); empty: all of it
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
