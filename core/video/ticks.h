// Time bases of movies. Pure.
#pragma once

#include <vector>

namespace color3d {

// Number of ticks per second, at most 65535, in which all times (s, ascending, from
// 0) are integers, so that frame times are preserved exactly at any rate: 16, 18, 24000/1001 a
// second, or uneven. 60000 if no usual time base fits; times then move by at most 8 microseconds.
int TicksPerSecond(const std::vector<double>& times_s);

}  // namespace color3d
