// How much of a training schedule a scene needs. Pure functions.
#pragma once

#include <algorithm>

namespace color3d {

// Share of a geometry schedule that a scene of so many training views needs, 2/3..1: all of it from
// 23 views on. Chosen on training views of fern, banana, fox and sceaux
// (tests/bench/notes/2026-11-engine-and-service.md).
inline double ScheduleShare(int training_views) {
  constexpr double kManyViews = 23.0;
  constexpr double kMinShare = 2.0 / 3.0;
  return std::clamp(training_views / kManyViews, kMinShare, 1.0);
}

}  // namespace color3d
