// Frame rate of films that do not state one. Constants.
#pragma once

namespace color3d {

inline constexpr double kDefaultFramesPerSecond = 25.0;

}  // namespace color3d
