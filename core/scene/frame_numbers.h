// What the numbers in the names of a film's pictures say: which frames are missing. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

struct FrameNumbers {
  std::vector<int64_t> places;  // of each picture: frames from the first one to it
  std::string note;             // which are missing, for the user; empty: none
};

// `names` in their order (base/name_order.h). Names that differ in one number only, which grows by
// the same step nearly always, tell which frames are missing: a gap keeps its frames' time.
// Pictures follow each other without gaps where names tell no such number, and where more frames
// would be missing than there are; the note says so.
FrameNumbers PlacesOfFrames(const std::vector<std::string>& names);

}  // namespace color3d
