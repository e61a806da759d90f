// Memory of personalization by purpose. For color3d-bench colorizer.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/colorizer/colorizer.h"
#include "core/encoder/encoder.h"

namespace color3d {

struct MemorySubject {
  std::shared_ptr<const Encoder> encoder;
  std::vector<TrainingPicture> keys;  // key view of each scene
  ColorizerOptions options;
  int threads = 0;  // 0: one per core
};

// Bytes of one scene's tensors by their purpose: parameters, optimiser, average (from a checkpoint
// of its training).
nlohmann::ordered_json TensorBytes(const MemorySubject& subject);

// Trains batches of the first 1, 2, 4, ... and all scenes, and returns the peak above
// `before_bytes`. "mib_shared" and "mib_per_scene" are intercept and slope of the line through the
// peaks of at least two scenes, where all compute slots are busy.
nlohmann::ordered_json PeakMemoryBySceneCount(const MemorySubject& subject, int64_t before_bytes);

}  // namespace color3d
