// Estimates that plans and time budgets share. Constants.
#pragma once

namespace color3d {

// Structure-from-motion on two cores. Measured: 0.5 s for 50 photos with much overlap, about 1 s
// for small or difficult sets.
inline constexpr double kPosesSecondsPerPhoto = 0.6;

}  // namespace color3d
