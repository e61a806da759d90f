// The error-against-time curve of a training. Plain values.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace color3d {

struct TrainingPoint {
  int64_t iteration = 0;
  double seconds = 0.0;               // of computing, not of waiting for a turn
  double train_l1_ab = 0.0;           // Lab units, running mean
  double validation_delta_e00 = 0.0;  // on augmentations that are never trained on
};

// A list of lists of these four numbers, and back. Throws nlohmann::json::exception on anything
// else.
nlohmann::json JsonFromCurve(const std::vector<TrainingPoint>& curve);
std::vector<TrainingPoint> CurveFromJson(const nlohmann::json& json);

}  // namespace color3d
