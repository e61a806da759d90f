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
  kFast,       // a box crosses the picture within three time steps and is otherwise absent
  kOneStep,    // the gliding box half way, at a single time
  kStill,      // the gliding box half way, all the time
  kDeforming,  // a sheet waves
};

// In the order above.
const std::vector<DynamicCase>& DynamicCases();
// "turning", "one_step".
std::string DynamicCaseName(DynamicCase which);
// The inverse. Throws Error{kInvalidArgument} with a list of the names.
DynamicCase DynamicCaseFromName(std::string_view name);

// Returns false for kOneStep and kStill, whose objects belong to the background.
bool IsMoving(DynamicCase which);

// Objects at time step `step` of `times`, in a fixed order; nullopt while one is absent. The motion
// is the same for any number of steps, except kFast, which takes three.
std::vector<std::optional<Solid>> MoversAt(DynamicCase which, int step, int times);

// Linear RGB, 0..1, of a mover's surface. Light is baked in and movers cast no shadow, so that
// points keep their colour and the background does not change.
Eigen::Vector3d PaintedColor(const Solid& mover,
                             const Hit& hit,
                             const Eigen::Vector3d& position,
                             double footprint_m,
                             uint32_t seed);

}  // namespace color3d
