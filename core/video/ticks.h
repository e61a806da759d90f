// Clocks of movies. Pure.
#pragma once

#include <vector>

namespace color3d {

// Ticks per second in which all these times (s, ascending, from 0) are whole numbers, 65535 at
// most, so that the frames of a film come back at exactly their own times whatever its rate: 16,
// 18 or 24000/1001 a second, or none. 60000 where no usual clock does; times then move by 8
// microseconds at most.
int TicksPerSecond(const std::vector<double>& times_s);

}  // namespace color3d
