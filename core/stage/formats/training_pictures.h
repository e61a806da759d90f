// The artifacts of generate_augmentations as pictures to train on.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/colorizer/colorizer.h"

namespace color3d {

// How often all generated pictures together are drawn for each time the key view is.
inline constexpr double kGeneratedShare = 0.5;

// `facts`: augmentations.json; `read` gives the bytes of an artifact by name. Pictures larger than
// `max_side_px` are reduced. Throws Error{kInvalidArgument} on damaged artifacts.
std::vector<TrainingPicture> TrainingPicturesFrom(
    std::string_view facts,
    const std::function<std::string(const std::string& name)>& read,
    int max_side_px,
    double share = kGeneratedShare);

}  // namespace color3d
