#include "core/scene/relief.h"

#include <algorithm>
#include <cmath>

namespace color3d {

double Relief::Depth(double row) const {
  return backdrop_depth * (foot - horizon) / (std::max(row, foot) - horizon);
}

Relief FitRelief(std::vector<double> feet) {
  constexpr double kFarthest = 0.1;                // quantile, to ignore detached limbs and shadows
  constexpr double kMargin = 0.02;                 // keeps feet off the backdrop
  constexpr double kHighest = 0.3, kLowest = 0.9;  // limits for the backdrop's foot
  constexpr double kDepthRatio = 4.0;              // of the backdrop to the nearest ground
  Relief relief;
  if (!feet.empty()) {
    const auto nth = feet.begin() +
                     static_cast<std::ptrdiff_t>(kFarthest * static_cast<double>(feet.size() - 1));
    std::nth_element(feet.begin(), nth, feet.end());
    relief.foot = std::clamp(*nth - kMargin, kHighest, kLowest);
  }
  relief.horizon = std::min(0.5, relief.foot - (1.0 - relief.foot) / (kDepthRatio - 1.0));
  return relief;
}

std::vector<Eigen::Vector3d> ReliefPoints(const Relief& relief, const Camera& camera, int count) {
  const double step =
      std::sqrt(static_cast<double>(camera.width) * camera.height / std::max(1, count));
  const auto columns = static_cast<int>(std::ceil(camera.width / step));
  const auto rows = static_cast<int>(std::ceil(camera.height / step));
  std::vector<Eigen::Vector3d> points;
  for (int j = 0; j < rows; ++j) {
    const double y = (j + 0.5) * camera.height / rows;
    for (int i = 0; i < columns; ++i) {
      const double x = (i + 0.5) * camera.width / columns;
      points.emplace_back(relief.Depth(y / camera.height) * camera.Ray(x, y));
    }
  }
  return points;
}

}  // namespace color3d
