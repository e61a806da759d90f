// All that the training of geometry has to remember. Internal to the splat module.
#pragma once

#include <string>
#include <string_view>

#include "core/splat/geometry/exposure.h"
#include "core/splat/geometry/moving_part.h"
#include "core/splat/raster/projection.h"
#include "core/splat/training/training_state.h"

namespace color3d {

struct GeometryState : TrainingState {
  DensifyStatistics statistics;  // of what stands still, then of what moves
  MovingPart moving;
  int64_t densified_at = 0;  // iteration
  Exposures exposures;       // of the training views, in their order; empty: none are fitted
};

// Everything that the course of training depends on, but for the pictures themselves. `moments`: 1
// where nothing may move; `initial_count`: Gaussians at the beginning.
std::string GeometryFingerprint(const GeometryProblem& problem,
                                const GeometryOptions& options,
                                int moments,
                                int64_t initial_count);

// `fingerprint` says what the state belongs to (options, scene); a state is only read back with the
// same one.
std::string SerializeGeometryState(const GeometryState& state, std::string_view fingerprint);
// False, and `state` unchanged, when the bytes are damaged or belong to something else.
bool ParseGeometryState(std::string_view bytes, std::string_view fingerprint, GeometryState& state);

}  // namespace color3d
