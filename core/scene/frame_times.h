// Which camera took a frame, and when: what the times in a file mean.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct FrameTime {
  std::string place;           // for errors: "transforms.json: frame 3"
  std::string file;            // of the picture, '/' separators
  std::optional<double> time;  // as the file has it: any finite number
  std::string camera;          // by name; empty: the file does not say
};

struct FrameMoments {
  std::vector<std::optional<Moment>> moments;  // one for each frame
  // Names by Moment::shot: as told, else folders relative to images/. Empty without moments.
  std::vector<std::string> cameras;
  std::string note;        // what the user should know; may be empty
  bool one_clock = false;  // several cameras follow one, to a quarter of its step
};

// Times are kept, but for their beginning: the earliest becomes 0, and those that differ by less
// than a millionth of all are one. Frames whose camera is not told: where several share a time,
// each folder is a camera; else all are one camera's. Where several cameras follow one clock to a
// quarter of its step (the median of theirs), each tick has one time, that of its earliest frame,
// and a note says so where more than rounding keeps them apart. No moments (and a note) where all
// times are the same: nothing can move. Throws Error{kInvalidArgument} that names the frames: some
// have a time and others none, some tell their camera and others do not, two of one camera at one
// time, times too far apart for a number.
FrameMoments MomentsOf(const std::vector<FrameTime>& frames);

}  // namespace color3d
