// Imports a folder of files as a posed Scene: detects the kind of input, reads poses or runs
// structure-from-motion, undistorts cameras, and validates everything.
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
  bool undistorted = false;    // a camera had lens distortion
  bool random_points = false;  // the input had none
  int photos_found = 0;
  int photos_registered = 0;
  int masked_views = 0;               // views with masked parts
  std::vector<std::string> cameras;   // dynamic scenes: names by Moment::shot
  std::vector<std::string> warnings;  // for the report; not sent to the observer
};

// `scene_folder` holds photos (directly or in images/), optionally with COLMAP models (text or
// binary, in the places that catalogue/pose_files.h lists) and times.txt, with transforms.json (or
// Blender's transforms_train.json, ...), or with LLFF's poses_bounds.npy; or the layout of Nerfies
// and HyperNeRF (metadata.json, camera/, rgb/). Of several models and formats, the one that places
// most photos is used, COLMAP's if no other places more, and a note names it; a times.txt without a
// COLMAP model causes a warning. Structure-from-motion runs only if none can be used.
// `scratch_folder` receives the files of structure-from-motion and sfm.log. Scenes far from the
// origin are recentred, very small and very large ones rescaled (import/normalise.h); points with
// fewer than 2 observations are dropped; poses without points get 20 000 seeded random ones. Warns
// of cameras whose intrinsics do not fit their observations. Writes no checkpoints.
// Throws Error for an empty folder, a single photo, unreadable photos, a model whose images are
// missing, masks that fit no photo (photo_masks.h), non-finite numbers, and points that all lie
// behind their cameras or absurdly far away. Photos whose cameras structure-from-motion does not
// find become a scene of pictures, with a warning that says why.
ImportResult ImportScene(const std::filesystem::path& scene_folder,
                         const std::filesystem::path& scratch_folder,
                         const ImportOptions& options,
                         const RunControl& run);

// One of the consecutive pictures of a camera. Paths are absolute, or relative to the working
// directory.
struct SequenceFrame {
  std::string name;
  std::filesystem::path file;
  std::filesystem::path mask_file;  // static regions (photo_masks.h); empty: everything
  int camera = 0;                   // each has a lens of its own
};

// Finds poses by structure-from-motion as for photos, except that each frame is matched only with
// its neighbours and with the most similar frames of other cameras; all pairs are never tried.
// Views have the names and the order of the frames; unregistered ones are missing. image_file and
// mask_file are the paths given. The caller runs FinishPosedScene. Throws Error as ImportScene.
ImportResult PlaceSequence(const std::vector<SequenceFrame>& frames,
                           const std::filesystem::path& scratch_folder,
                           const ImportOptions& options,
                           const RunControl& run);

// The steps of ImportScene that follow once views have poses: checks, coordinates, points if there
// are none, held-out views.
void FinishPosedScene(const ImportOptions& options, ImportResult* result);

// Marks every eighth view as held out, starting with the first; in dynamic scenes all views of
// every eighth time, starting with the fifth. Warns if the scene has too few.
void HoldOutEveryEighth(Scene* scene, std::vector<std::string>* warnings);

}  // namespace color3d
