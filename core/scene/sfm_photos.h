// Copies of the photos that COLMAP can read whatever the originals are. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/progress.h"
#include "core/scene/photos.h"

namespace color3d {

// 1 channel, 0..1, for feature detection: luma, reduced to max_side_px, and stretched when the
// photo uses less than half of the range (16-bit scans often do; SIFT's threshold is absolute).
Image FeatureImage(const Image& photo, int max_side_px);

// Writes photo i as <width>x<height>/<i + 1 as 6 digits>.png below `folder`, EXIF orientation
// applied, so that photos of one size share a folder and with it a camera. Returns the relative
// names.
std::vector<std::string> WriteFeatureImages(const std::vector<Photo>& photos,
                                            const std::filesystem::path& scene_folder,
                                            const std::filesystem::path& folder,
                                            int max_side_px,
                                            ProgressObserver& progress,
                                            const CancellationToken& cancel);

}  // namespace color3d
