// Copies of the photos in a format that COLMAP reads. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"
#include "core/image/local_features.h"
#include "core/scene/photos.h"

namespace color3d {

// Returns luma for feature detection: 1 channel, 0..1, reduced to max_side_px, and stretched if the
// photo uses less than half of the range (16-bit scans often do; the threshold of SIFT is
// absolute).
Image FeatureImage(const Image& photo, int max_side_px);

// The copies on disk, and facts found while they were written.
struct FeatureImages {
  // Photos of one folder, size and focal length: they share a camera.
  struct Group {
    int width = 0;  // of the copies, px
    int height = 0;
    double focal_px = 0.0;  // of the copies; 0: unknown
    int camera = 0;         // as Photo::camera
    std::vector<std::string> names;
  };
  std::vector<std::string> names;       // of all copies, relative to the folder, in photos' order
  std::vector<Group> groups;            // together all names
  std::vector<LocalFeatures> features;  // per photo, for CompareAll; empty unless asked for
  bool masked = false;                  // some photo has a mask
};

// Writes photo i as <width>x<height>[_f<focal>][_c<camera>]/<i + 1 as 6 digits>.png below `folder`,
// with EXIF orientation applied, and its mask, if any, under the same name with .png added below
// `mask_folder`, as COLMAP expects. If `local_features` > 0, also finds that many features in each
// photo, without masked ones.
FeatureImages WriteFeatureImages(const std::vector<Photo>& photos,
                                 const std::filesystem::path& scene_folder,
                                 const std::filesystem::path& folder,
                                 const std::filesystem::path& mask_folder,
                                 int max_side_px,
                                 int local_features,
                                 const RunControl& run);

}  // namespace color3d
