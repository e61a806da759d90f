// The photographs of a scene's folder: which files they are, how large they look, and how a camera
// that was calibrated for the stored pixels becomes one for the picture as it is looked at. For
// this folder only.
#pragma once

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
  int width = 0;        // px, as looked at: after orientation
  int height = 0;
  double focal_px = 0.0;  // from EXIF; 0: unknown
  std::string mask_file;  // as View::mask_file
  int camera = 0;         // photos of different cameras never share a lens
};

// Photos in images/ (any depth) when there are some, else those directly in the folder, else those
// in subfolders other than augment, masks and hidden ones. Sorted by name; sizes are not read yet.
std::vector<Photo> ListPhotos(const std::filesystem::path& scene_folder);

// Fills sizes, orientation and focal length; refuses files that are no images, cut short or too
// large (Error{kInvalidArgument} that names the file).
void ProbePhoto(const std::filesystem::path& scene_folder, Photo* photo);

// Makes the view's captured camera (calibrated at any size, for the pixels as stored) fit the
// photo: scaled when the photo is another size of the same shape, and turned with its EXIF
// orientation. Then sets the undistorted camera. Throws Error{kInvalidArgument} naming both sizes
// when the shapes differ.
void FitViewToPhoto(const Photo& photo, View* view);

}  // namespace color3d
