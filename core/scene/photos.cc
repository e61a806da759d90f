#include "core/scene/photos.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/focal_length.h"
#include "core/image/probe/orientation.h"
#include "core/image/probe/probe.h"
#include "core/scene/lens.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Returns true for the same shape up to the rounding of a downscaled copy: one pixel of the smaller
// picture.
bool SameShape(int width, int height, int other_width, int other_height) {
  const double sx = static_cast<double>(other_width) / width;
  const double sy = static_cast<double>(other_height) / height;
  const bool shrinks = sx <= 1.0;
  return shrinks ? std::abs(height * sx - other_height) <= 1.0 ||
                       std::abs(width * sy - other_width) <= 1.0
                 : std::abs(other_height / sx - height) <= 1.0 ||
                       std::abs(other_width / sy - width) <= 1.0;
}

// Rotates the camera frame by 180 or +-90 degrees about its axis, as EXIF orientations 3, 6 and 8
// rotate photos. Radial distortion is unchanged, tangential terms swap.
void TurnView(int orientation, View* view) {
  const Camera c = view->captured_camera;
  const double w = c.width;
  const double h = c.height;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  auto& k = view->distortion.k;
  const double p1 = k[2];
  const double p2 = k[3];
  const bool tangential = view->distortion.model == Distortion::Model::kBrown;
  if (orientation == 3) {  // (u, v) -> (w - u, h - v)
    turn.diagonal() << -1, -1, 1;
    view->captured_camera = {c.width, c.height, c.fx, c.fy, w - c.cx, h - c.cy};
    if (tangential) k[2] = -p1, k[3] = -p2;
  } else if (orientation == 6) {  // (u, v) -> (h - v, u)
    turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    view->captured_camera = {c.height, c.width, c.fy, c.fx, h - c.cy, c.cx};
    if (tangential) k[2] = p2, k[3] = -p1;
  } else if (orientation == 8) {  // (u, v) -> (v, w - u)
    turn << 0, 1, 0, -1, 0, 0, 0, 0, 1;
    view->captured_camera = {c.height, c.width, c.fy, c.fx, c.cy, w - c.cx};
    if (tangential) k[2] = -p2, k[3] = p1;
  }
  Pose& pose = view->cam_from_world;
  pose.rotation = (Eigen::Quaterniond(turn) * pose.rotation).normalized();
  pose.translation = turn * pose.translation;
}

}  // namespace

std::vector<Photo> ListPhotos(const fs::path& scene_folder) {
  std::vector<Photo> in_images, direct, deeper;
  for (const std::string& file : ListFiles(scene_folder)) {
    if (!HasImageExtension(file)) continue;
    if (file.starts_with("images/")) {
      in_images.push_back({file.substr(7), file});
    } else if (file.find('/') == std::string::npos) {
      direct.push_back({file, file});
    } else if (!IsAugmentFile(file) && !IsMaskFile(file)) {
      deeper.push_back({file, file});
    }
  }
  if (!in_images.empty()) return in_images;
  return direct.empty() ? deeper : direct;
}

void ProbePhoto(const fs::path& scene_folder, Photo* photo) {
  const std::string bytes = ReadFile(scene_folder / photo->file);
  const ImageInfo info = ProbeImage(bytes, photo->name);
  photo->orientation = ReadOrientation(bytes);
  photo->stored_width = info.width;
  photo->stored_height = info.height;
  photo->focal_px = ReadFocalLengthPx(bytes, info.width, info.height);
  const PictureSize size = OrientedSize(info, photo->orientation);
  photo->width = size.width;
  photo->height = size.height;
}

void FitViewToPhoto(const Photo& photo, View* view) {
  const Camera& camera = view->captured_camera;
  const int w = photo.stored_width;
  const int h = photo.stored_height;
  // Calibration tools such as COLMAP use stored pixels. A camera that fits only the displayed
  // picture comes from a tool that rotates photos first.
  const bool as_stored = SameShape(camera.width, camera.height, w, h);
  const bool as_seen = SameShape(camera.width, camera.height, photo.width, photo.height);
  if (!as_stored && !as_seen) {
    throw InvalidArgument(
        "photo {} has {} but its camera was calibrated for {}; use the photos that the poses were "
        "computed from",
        photo.name,
        SizeText(photo.width, photo.height),
        SizeText(camera.width, camera.height));
  }
  if (as_stored) {
    view->captured_camera = camera.Scaled(w, h);
    if (photo.orientation == 2 || photo.orientation == 4 || photo.orientation == 5 ||
        photo.orientation == 7) {
      throw InvalidArgument(
          "photo {} is mirrored by its EXIF orientation {}, which no camera pose can express; save "
          "it upright and compute its pose again",
          photo.name,
          photo.orientation);
    }
    TurnView(photo.orientation, view);
  } else {
    view->captured_camera = camera.Scaled(photo.width, photo.height);
  }
  try {
    view->camera = UndistortedCamera(view->captured_camera, view->distortion);
  } catch (const Error& e) {
    throw Error(e.code(), "photo {}: {}", photo.name, e.what());
  }
}

void FitViewToFile(const fs::path& scene_folder, View* view) {
  Photo photo{view->name, view->image_file};
  ProbePhoto(scene_folder, &photo);
  FitViewToPhoto(photo, view);
}

}  // namespace color3d
