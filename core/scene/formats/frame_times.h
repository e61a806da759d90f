// When the frames of a transforms.json were taken, and by which camera. For this folder only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// What one frame says.
struct FrameTime {
  std::optional<double> time;  // finite; seconds, or 0..1 for the whole
  std::string camera;          // empty: not said
};

// Sets the moment of every view (in the order of `times`), counted from the first; none when no
// frame has a time. Without names of cameras, frames in one folder are one camera's where a time
// occurs more than once, else all are. Throws Error{kInvalidArgument}: only some frames have a time
// or a camera; a camera has two frames of one time. `file_name` is for messages.
void SetMoments(const std::vector<FrameTime>& times,
                const std::string& file_name,
                std::vector<View>* views);

}  // namespace color3d
