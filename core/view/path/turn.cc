#include "core/view/path/turn.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace color3d {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kLargestGap = kTwoPi / 4;  // between neighbours of a full circle
constexpr double kLeastReach = 0.1, kMostReach = 0.35;
// Standard deviations in the weight of a photo: azimuth from the current position, elevation and
// logarithm of distance from the key view.
constexpr double kNearAround = 0.45, kNearUp = 0.35, kNearAway = 0.5;
constexpr double kHome = 0.02;       // weight of the key view's height and distance everywhere
constexpr double kHomeAround = 0.6;  // radians from the key view on which the way leaves it

Turn::Place ToSpherical(const Eigen::Vector3d& position) {
  return {std::atan2(position.x(), position.z()),
          std::atan2(position.y(), std::hypot(position.x(), position.z())),
          std::log(std::max(position.norm(), 1e-6))};
}

// Bell curve of the angle with this standard deviation; 1 at zero.
double Nearness(double angle, double deviation) {
  return std::exp((std::cos(angle) - 1.0) / (deviation * deviation));
}

// Mean height and distance of the photos near this angle.
Turn::Place MeanOfNearbyPhotos(const Turn& turn, double angle) {
  double weights = kHome;
  double height = kHome * turn.start.height, log_distance = kHome * turn.start.log_distance;
  for (const Turn::Place& photo : turn.photos) {
    const double up = (photo.height - turn.start.height) / kNearUp;
    const double away = (photo.log_distance - turn.start.log_distance) / kNearAway;
    const double weight =
        Nearness(photo.angle - angle, kNearAround) * std::exp(-0.5 * (up * up + away * away));
    height += weight * photo.height;
    log_distance += weight * photo.log_distance;
    weights += weight;
  }
  return {angle, height / weights, log_distance / weights};
}

}  // namespace

Turn TurnOf(const Scene& scene, int key_view, const ScenePlacement& placement) {
  Turn turn;
  turn.start = ToSpherical(
      placement.Apply(scene.views.at(static_cast<size_t>(key_view)).cam_from_world.Center()));
  std::vector<double> angles;  // 0..2 pi
  for (const View& view : scene.views) {
    Turn::Place photo = ToSpherical(placement.Apply(view.cam_from_world.Center()));
    photo.angle -= turn.start.angle;
    turn.photos.push_back(photo);
    angles.push_back(photo.angle - kTwoPi * std::floor(photo.angle / kTwoPi));
  }
  angles.push_back(kTwoPi);  // the key view's own, again
  std::sort(angles.begin(), angles.end());
  double gap = 0.0, last = 0.0, first = 0.0;  // the largest gap: from `last` on to `first`
  double before = 0.0;
  for (const double angle : angles) {
    if (angle - before > gap) {
      gap = angle - before;
      last = before;
      first = angle;
    }
    before = angle;
  }
  turn.around = gap < kLargestGap;
  if (turn.around) return turn;
  const double left = first - kTwoPi, right = last;  // left <= 0 <= right: where photos are
  turn.reach = std::clamp(0.5 * (right - left), kLeastReach, kMostReach);
  const double room = std::max(0.0, 0.5 * (right - left) - turn.reach);
  turn.middle = 0.5 * (left + right);
  turn.middle = std::clamp(0.0, turn.middle - room, turn.middle + room);
  // The path passes through the key view.
  turn.middle = std::clamp(turn.middle, -turn.reach, turn.reach);
  return turn;
}

Eigen::Vector3d TurnPosition(const Turn& turn, double share) {
  double angle = kTwoPi * share;
  if (!turn.around) {
    const double start = std::asin(std::clamp(-turn.middle / turn.reach, -1.0, 1.0));
    angle = turn.middle + turn.reach * std::sin(start + angle);
  }
  const Turn::Place here = MeanOfNearbyPhotos(turn, angle), home = MeanOfNearbyPhotos(turn, 0.0);
  const double near = Nearness(angle, kHomeAround);  // the key view itself is on the way
  const double height = here.height + near * (turn.start.height - home.height);
  const double distance =
      std::exp(here.log_distance + near * (turn.start.log_distance - home.log_distance));
  const double whole = turn.start.angle + angle;
  return {distance * std::cos(height) * std::sin(whole),
          distance * std::sin(height),
          distance * std::cos(height) * std::cos(whole)};
}

}  // namespace color3d
