// A self-contained page that shows a coloured scene in a browser: scene, photos and viewer in one
// file, without network access (EXPORT.md "Viewer"). Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"
#include "core/view/scene_placement.h"

namespace color3d {

// Returns false if the viewer was left out at build time; pages cannot be made then.
bool HasViewer();

struct ViewPagePhoto {
  int view = 0;      // index in the scene
  std::string jpeg;  // undistorted, any size; empty: camera without picture
};

// Motion of the Gaussians, and how it plays.
struct ViewPageMotion {
  std::string file;             // core/splat/export/motion/FORMAT.md, of the same Gaussians
  double shown_s = 0.0;         // time at which the page opens, seconds of the scene
  double seconds = 1.0;         // duration of one playing, > 0
  int steps = 2;                // distinct times of the photos, >= 2
  bool times_are_known = true;  // false: the label counts steps, not seconds
  std::vector<int> film;        // views of the film of the key view's camera, in order of time
};

// A small MP4 that the page shows where it cannot draw the scene; its sound goes along with the
// motion.
struct ViewPageMovie {
  std::string bytes;  // empty: none
  bool has_sound = false;
  bool shows_motion = false;  // else the scene stands, and the camera turns
};

struct ViewPage {
  // The exported file and the transform of its coordinates: file = scale * scene + offset.
  std::string file_name;  // its extension gives the format: .ply, .sog
  std::string file_bytes;
  bool file_is_compressed = false;  // compressing it again would gain nothing
  double file_scale = 1.0;
  Eigen::Vector3d file_offset = Eigen::Vector3d::Zero();
  // Confidence of each Gaussian's colour, 0..1, in the file's order; empty: unknown.
  std::vector<float> confidence;

  int key_view = 0;                                 // index in the scene; must be among `photos`
  Eigen::Vector3d focus = Eigen::Vector3d::Zero();  // its focus, in the scene's units
  std::string poster;                               // JPEG of the scene from the key view
  std::optional<ViewPageMotion> motion;             // nullopt: a still scene
  ViewPageMovie movie;
  std::vector<ViewPagePhoto> photos;
};

// Returns the whole file. Throws Error{kFailedPrecondition} without HasViewer(),
// Error{kInvalidArgument} if the key view is not among the photos or has no focus (PlaceScene).
std::string RenderViewPage(const Scene& scene, const ViewPage& page);

}  // namespace color3d
