// Finds missing frames by the numbers in the names of a film's pictures. Pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

struct FrameNumbers {
  std::vector<int64_t> places;  // of each picture: frames from the first one to it
  std::string note;             // names the missing frames for the user; empty: none
};

// Requires: `names` in order (base/name_order.h). If the names differ in one number only, which
// nearly always grows by the same step, gaps in it are missing frames and keep their time. Pictures
// count as consecutive if the names have no such number, or if more frames would be missing than
// there are, which the note reports.
FrameNumbers FramePositions(const std::vector<std::string>& names);

}  // namespace color3d
