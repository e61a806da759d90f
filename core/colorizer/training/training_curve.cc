#include "core/colorizer/training/training_curve.h"

#include <nlohmann/json.hpp>

namespace color3d {

nlohmann::json JsonFromCurve(const std::vector<TrainingPoint>& curve) {
  auto json = nlohmann::json::array();
  for (const TrainingPoint& point : curve) {
    json.push_back({point.iteration, point.seconds, point.train_l1_ab, point.validation_delta_e00});
  }
  return json;
}

std::vector<TrainingPoint> CurveFromJson(const nlohmann::json& json) {
  std::vector<TrainingPoint> curve;
  for (const nlohmann::json& point : json) {
    curve.push_back({point.at(0), point.at(1), point.at(2), point.at(3)});
  }
  return curve;
}

}  // namespace color3d
