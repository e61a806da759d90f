// Training pictures from the artifacts of generate_augmentations. Pure functions.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/colorizer/colorizer.h"

namespace color3d {

// Frequency of all generated pictures together in training, relative to the key view.
inline constexpr double kGeneratedShare = 0.5;

// `facts`: augmentations.json; `read` returns the bytes of an artifact. Pictures larger than
// `max_side_px` are reduced. Throws Error{kInvalidArgument} for damaged artifacts.
std::vector<TrainingPicture> TrainingPicturesFrom(
    std::string_view facts,
    const std::function<std::string(const std::string& name)>& read,
    int max_side_px,
    double share = kGeneratedShare);

}  // namespace color3d
