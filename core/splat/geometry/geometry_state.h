// The complete state of training geometry. Internal to the splat module.
#pragma once

#include <string>
#include <string_view>

#include "core/splat/geometry/exposure.h"
#include "core/splat/geometry/moving_part.h"
#include "core/splat/raster/projection.h"
#include "core/splat/training/hexplane_training.h"
#include "core/splat/training/training_state.h"

namespace color3d {

struct GeometryState : TrainingState {
  DensifyStatistics statistics;  // of the static part, then of the moving part
  MovingPart moving;
  HexPlaneState hexplane;    // empty unless it is trained
  int64_t densified_at = 0;  // iteration
  Exposures exposures;       // of the training views, in their order; empty: not fitted
};

// Visits all values in the order of checkpoints. `archive`: CheckpointWriter or CheckpointReader.
template <class Archive, class State>
void VisitGeometryState(Archive& archive, State& state) {
  VisitState(archive, state);
  archive.Vector(state.statistics.gradient);
  archive.Vector(state.statistics.count);
  archive.Vector(state.statistics.radius);
  archive.Block(state.moving.parameters);
  archive.Block(state.moving.moments.first);
  archive.Block(state.moving.moments.second);
  VisitHexPlaneState(archive, state.hexplane);
  archive.Value(state.densified_at);
  archive.Vector(state.exposures);
}

// All inputs of training except the pictures. `moments`: number of time steps, 1 for static scenes;
// `initial_count`: initial number of Gaussians.
std::string GeometryFingerprint(const GeometryProblem& problem,
                                const GeometryOptions& options,
                                int moments,
                                int64_t initial_count);

// `fingerprint` identifies the options and the scene; a state is only restored with the same one.
std::string SerializeGeometryState(const GeometryState& state, std::string_view fingerprint);
// Returns false, with `state` unchanged, if the bytes are damaged or have another fingerprint.
bool ParseGeometryState(std::string_view bytes, std::string_view fingerprint, GeometryState& state);

}  // namespace color3d
