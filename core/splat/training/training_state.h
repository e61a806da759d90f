// All that training has to remember, as a value and as checkpoint bytes. Internal to the splat
// module.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/random.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/raster/projection.h"
#include "core/splat/training/adam.h"

namespace color3d {

struct TrainingState {
  ParameterBlock parameters;
  AdamMoments moments;
  DensifyStatistics statistics;
  Random random{0};
  int64_t iteration = 0;
  std::vector<int32_t> order;  // of the training views, shuffled
  int64_t next_in_order = 0;
  double rate_scale = 1.0;  // halved by every restore
  int32_t restores = 0;
  double mean_error = 0.0;       // running mean of the L1 error, 0 before the first iteration
  double elapsed_seconds = 0.0;  // of training, over all attempts; set when saved
  int64_t densified_at = 0;      // iteration

  // Next view to train on: random order without replacement.
  int NextView(int view_count);
};

// `fingerprint` says what the state belongs to (options, scene); a state is only read back with the
// same one.
std::string SerializeTrainingState(const TrainingState& state, std::string_view fingerprint);
// False, and `state` unchanged, when the bytes are damaged or belong to something else.
bool ParseTrainingState(std::string_view bytes, std::string_view fingerprint, TrainingState& state);

}  // namespace color3d
