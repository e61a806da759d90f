// Moving objects of the synthetic dynamic scenes, and their motion. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/scenes/solid.h"

namespace color3d {

enum class DynamicCase {
  kTurning,    // a box and a ball turn in place, in opposite directions
  kSliding,    // a box glides along a line, about a fifth of the picture's width in all
  kAppearing,  // a ball is there from a third of the time on, a box until two thirds
  kFast,       // a box crosses the picture within three time steps and is seen in no other
  kOneStep,    // the gliding box half way, at a single time
  kStill,      // the gliding box half way, all the time
  kDeforming,  // a sheet waves
};

// In the order above.
const std::vector<DynamicCase>& DynamicCases();
// "turning", "one_step".
std::string DynamicCaseName(DynamicCase which);
// The inverse; throws Error{kInvalidArgument} that lists the names.
DynamicCase DynamicCaseFromName(std::string_view name);

// False for kOneStep and kStill, whose objects belong to the background.
bool IsMoving(DynamicCase which);

// The things at time step `step` of `times`, always in the same order; nothing while one is not
// there. They move through the same in fewer or more steps, kFast alone in three.
std::vector<std::optional<Solid>> MoversAt(DynamicCase which, int step, int times);

// Linear RGB, 0..1, of a mover's surface: its light is painted on, so that a point keeps its colour
// wherever the mover goes, and it throws no shadow, so that nothing else changes.
Eigen::Vector3d PaintedColor(const Solid& mover,
                             const Hit& hit,
                             const Eigen::Vector3d& position,
                             double footprint_m,
                             uint32_t seed);

}  // namespace color3d
