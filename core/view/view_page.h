// The page to look at a coloured scene in a browser: one file with the scene, the photos and the
// viewer in it, which asks no network (EXPORT.md "Viewer"). Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"
#include "core/view/stand.h"

namespace color3d {

// False when the viewer was left out at build time; there are no pages then.
bool HasViewer();

struct ViewPagePhoto {
  int view = 0;      // index in the scene
  std::string jpeg;  // undistorted, of any size; empty: no picture, its camera only
};

struct ViewPage {
  // The exported file, and how its coordinates came about: file = scale * scene + offset.
  std::string file_name;  // its extension says the format: .ply, .sog
  std::string file_bytes;
  bool file_is_compressed = false;  // packing it again would gain nothing
  double file_scale = 1.0;
  Eigen::Vector3d file_offset = Eigen::Vector3d::Zero();
  // How sure each Gaussian's colour is, 0..1, in the file's order; empty: nobody knows.
  std::vector<float> confidence;

  int key_view = 0;                                 // index in the scene; must be among `photos`
  Eigen::Vector3d focus = Eigen::Vector3d::Zero();  // what it looks at, in the scene's units
  std::string poster;                               // JPEG of the scene from there
  std::vector<ViewPagePhoto> photos;
};

// The whole file. Throws Error{kFailedPrecondition} without HasViewer(), Error{kInvalidArgument}
// when the key view is not among the photos or has no focus (StandOf).
std::string RenderViewPage(const Scene& scene, const ViewPage& page);

// RFC 1952.
std::string Gzip(std::string_view bytes);

}  // namespace color3d
