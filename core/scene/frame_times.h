// Interprets the times in a file: camera and moment of each frame.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct FrameTime {
  std::string place;           // for errors: "transforms.json: frame 3"
  std::string file;            // of the picture, '/' separators
  std::optional<double> time;  // as in the file: any finite number
  std::string camera;          // name; empty: not in the file
};

struct FrameMoments {
  std::vector<std::optional<Moment>> moments;  // one for each frame
  // Names by Moment::shot: from the file, else folders relative to images/. Empty without moments.
  std::vector<std::string> cameras;
  std::string note;        // for the user; may be empty
  bool one_clock = false;  // several cameras follow one, to a quarter of its step
};

// Keeps the times, shifted so that the earliest is 0; times closer than a millionth of the whole
// range are made equal. Without camera names: if frames share a time, each folder is a camera; else
// all frames are of one camera. If several cameras follow one clock to a quarter of its step (the
// median step), all frames of a tick get the time of its earliest frame; a note reports
// differences beyond rounding. Without moments, with a note, if all times are equal: nothing
// can move. Throws Error{kInvalidArgument} that names the frames if only some have a time, only
// some name a camera, two of one camera have the same time, or times are too far apart for a
// number.
FrameMoments AssignMoments(const std::vector<FrameTime>& frames);
// Gives the views of the scene their moments, in order. `warnings` (may be null) receives the note,
// `cameras` (may be null) the names of the cameras.
void AddMoments(FrameMoments moments,
                Scene* scene,
                std::vector<std::string>* warnings,
                std::vector<std::string>* cameras);

}  // namespace color3d
