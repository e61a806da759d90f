// Photos in a scene's folder: the files, their displayed sizes, and the conversion of cameras
// calibrated for stored pixels to the displayed picture. For this folder only.
#pragma once

#include <fmt/core.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/scene/scene.h"

namespace color3d {

struct Photo {
  std::string name;      // relative to the images folder
  std::string file;      // relative to the scene's folder
  int stored_width = 0;  // px
  int stored_height = 0;
  int orientation = 1;  // EXIF, 1..8
  int width = 0;        // px, as displayed: after orientation
  int height = 0;
  double focal_px = 0.0;  // from EXIF; 0: unknown
  std::string mask_file;  // as View::mask_file
  int camera = 0;         // photos of different cameras never share a lens
};

// "640 x 480 px", for messages.
inline std::string SizeText(int width, int height) {
  return fmt::format("{} x {} px", width, height);
}

// Returns the photos in images/ (any depth) if there are some, else those directly in the folder,
// else those in subfolders other than augment, masks and hidden ones. Sorted by name; sizes are not
// read yet.
std::vector<Photo> ListPhotos(const std::filesystem::path& scene_folder);

// Reads size, orientation and focal length. Throws Error{kInvalidArgument} that names the file if
// it is no image, is truncated or too large.
void ProbePhoto(const std::filesystem::path& scene_folder, Photo* photo);

// Fits the view's captured camera (calibrated at any size, for stored pixels) to the photo: scales
// it if the photo has another size of the same shape, and rotates it by the EXIF orientation. Then
// sets the undistorted camera. Throws Error{kInvalidArgument} naming both sizes if the shapes
// differ.
void FitViewToPhoto(const Photo& photo, View* view);
// Probes the photo of a view with name and image_file, and fits the view to it.
void FitViewToFile(const std::filesystem::path& scene_folder, View* view);

}  // namespace color3d
