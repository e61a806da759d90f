// What personalization keeps in memory, in its parts. For color3d-bench colorizer.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/colorizer/colorizer.h"

namespace color3d {

struct MemorySubject {
  std::shared_ptr<const Encoder> encoder;
  std::vector<TrainingPicture> keys;  // of one scene each
  ColorizerOptions options;
  int threads = 0;  // 0: what the machine has
};

// Bytes of one scene's tensors by their purpose: parameters, optimiser, average (from a checkpoint
// of its training).
nlohmann::ordered_json TensorBytes(const MemorySubject& subject);

// Trains the first 1, 2, 4, ... scenes (at last all) in one batch each and gives the peak above
// `before_bytes`; "mib_shared" and "mib_per_scene" are intercept and slope of the line through the
// peaks of two scenes and more, in which all compute slots are busy.
nlohmann::ordered_json PeakMemoryBySceneCount(const MemorySubject& subject, int64_t before_bytes);

}  // namespace color3d
