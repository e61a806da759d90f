// What the studio found in a set of photos, and small pictures of them, for the page. Thread-safe.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"
#include "client/studio/photo_sets.h"
#include "color3d/v1/job.pb.h"
#include "core/base/cancellation.h"
#include "core/base/image.h"

namespace color3d::client {

// One film of one camera, as a video file or as pictures.
bool IsFilm(const PhotoFolder& folder);

// kind ("photos", "film", "films", "splat"), name, bytes, has_poses, in_color (true, false, or null
// if unsure), notes on what is odd (by name), and photos: for each its name as a view, width and
// height in px (0: not a picture that can be used, with the problem). Reads the headers of at most
// 400 photos.
nlohmann::ordered_json DescribePhotos(const PhotoFolder& folder, const CancellationToken& cancel);

// What is odd about the sizes of photos, by name: few that differ from most, and scans that need
// much memory. `photos` as in DescribePhotos.
std::vector<std::string> SizeNotes(const nlohmann::ordered_json& photos);

// CollectPhotos of a set; errors and notes call its folder by the name of the set.
PhotoFolder CollectSet(const PhotoSet& set);

// Facts for a plan before the upload.
v1::CaptureFacts CaptureFactsOf(const PhotoFolder& folder);

// The photo whose name as a view is `name`. Throws Error{kNotFound}.
const LocalFile& PhotoOfView(const PhotoFolder& folder, const std::string& name);

// The photo as a JPEG with its longer side at most `max_side_px` (0: its own size), upright, in
// sRGB. `gray`: its luminance. Throws Error{kInvalidArgument} if it cannot be decoded.
std::string PhotoJpeg(const LocalFile& photo, int max_side_px, bool gray);
// The same of a picture in sRGB. `quality`: of the JPEG, 1 to 100.
std::string PictureJpeg(const Image& picture, int max_side_px, bool gray, int quality);

}  // namespace color3d::client
