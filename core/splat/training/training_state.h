// Common state of trainings by Adam, as a value and in checkpoints. Internal to the splat module.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/random.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/training/adam.h"
#include "core/splat/training/checkpoint.h"

namespace color3d {

// The training views in random order without replacement, reshuffled after each pass.
struct ViewOrder {
  std::vector<int32_t> views;
  int64_t next = 0;  // position in `views`

  int Next(int view_count, Random& random);
};

struct TrainingState {
  ParameterBlock parameters;
  AdamMoments moments;
  Random random{0};
  ViewOrder order;
  int64_t iteration = 0;
  double rate_scale = 1.0;  // halved by every restore
  int32_t restores = 0;
  double mean_error = 0.0;       // running mean of the L1 error, 0 before the first iteration
  double elapsed_seconds = 0.0;  // of training, over all attempts; set when saved
};

// Visits all values in the order of checkpoints. `archive`: CheckpointWriter or CheckpointReader.
template <class Archive, class State>
void VisitState(Archive& archive, State& state) {
  archive.Block(state.parameters);
  archive.Block(state.moments.first);
  archive.Block(state.moments.second);
  archive.Value(state.random);
  archive.Vector(state.order.views);
  archive.Value(state.order.next);
  archive.Value(state.iteration);
  archive.Value(state.rate_scale);
  archive.Value(state.restores);
  archive.Value(state.mean_error);
  archive.Value(state.elapsed_seconds);
}

}  // namespace color3d
