// What the studio found in a set of photos, and small pictures of them, for the page. Thread-safe.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/lib/photos/photo_folder.h"
#include "color3d/v1/job.pb.h"
#include "core/base/cancellation.h"

namespace color3d::client {

// kind ("photos", "film", "films", "splat"), name, bytes, has_poses, in_color (true, false, or null
// if unsure), notes on what is odd, and photos: for each its name as a view, width and height in px
// (0: not a picture that can be used, with the problem). Reads the headers of at most 400 photos.
nlohmann::ordered_json DescribePhotos(const PhotoFolder& folder, const CancellationToken& cancel);

// Facts for a plan before the upload.
v1::CaptureFacts CaptureFactsOf(const PhotoFolder& folder);

// The photo whose name as a view is `name`. Throws Error{kNotFound}.
const LocalFile& PhotoOfView(const PhotoFolder& folder, const std::string& name);

// The photo as a JPEG with its longer side at most `max_side_px` (0: its own size), upright, in
// sRGB. `gray`: its luminance. Throws Error{kInvalidArgument} if it cannot be decoded.
std::string PhotoJpeg(const LocalFile& photo, int max_side_px, bool gray);

}  // namespace color3d::client
