// Training curve: error against time. Plain values.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace color3d {

struct TrainingPoint {
  int64_t iteration = 0;
  double seconds = 0.0;               // computing time, without waiting for a turn
  double train_l1_ab = 0.0;           // Lab units, running mean
  double validation_delta_e00 = 0.0;  // on held-out augmentations
};

// Converts to and from a JSON list of lists of these four numbers. CurveFromJson throws
// nlohmann::json::exception for other input.
nlohmann::json JsonFromCurve(const std::vector<TrainingPoint>& curve);
std::vector<TrainingPoint> CurveFromJson(const nlohmann::json& json);

}  // namespace color3d
