#include "core/view/path/turn.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace color3d {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kLargestGap = kTwoPi / 4;  // between neighbours that stand all around
constexpr double kLeastReach = 0.1, kMostReach = 0.35;

double AngleOf(const Eigen::Vector3d& position) { return std::atan2(position.x(), position.z()); }

}  // namespace

Turn TurnOf(const Scene& scene, int key_view, const Stand& stand) {
  Turn turn;
  turn.start = stand.Apply(scene.views.at(static_cast<size_t>(key_view)).cam_from_world.Center());
  const double key = AngleOf(turn.start);
  std::vector<double> angles;  // from the key view's, 0..2 pi
  for (const View& view : scene.views) {
    const double angle = AngleOf(stand.Apply(view.cam_from_world.Center())) - key;
    angles.push_back(angle - kTwoPi * std::floor(angle / kTwoPi));
  }
  angles.push_back(kTwoPi);  // the key view's own, again
  std::sort(angles.begin(), angles.end());
  double gap = 0.0, last = 0.0, first = 0.0;  // the largest gap: from `last` on to `first`
  double before = 0.0;
  for (const double angle : angles) {
    if (angle - before > gap) gap = angle - before, last = before, first = angle;
    before = angle;
  }
  turn.around = gap < kLargestGap;
  if (turn.around) return turn;
  const double left = first - kTwoPi, right = last;  // left <= 0 <= right: where photos are
  turn.reach = std::clamp(0.5 * (right - left), kLeastReach, kMostReach);
  const double room = 0.5 * (right - left) - turn.reach;
  turn.middle = 0.5 * (left + right);
  if (room > 0.0) turn.middle = std::clamp(0.0, turn.middle - room, turn.middle + room);
  // The key view is on the way.
  turn.middle = std::clamp(turn.middle, -turn.reach, turn.reach);
  return turn;
}

Eigen::Vector3d TurnPosition(const Turn& turn, double share) {
  double angle = kTwoPi * share;
  if (!turn.around) {
    const double start = std::asin(std::clamp(-turn.middle / turn.reach, -1.0, 1.0));
    angle = turn.middle + turn.reach * std::sin(start + angle);
  }
  const double radius = std::hypot(turn.start.x(), turn.start.z());
  const double whole = AngleOf(turn.start) + angle;
  return {radius * std::sin(whole), turn.start.y(), radius * std::cos(whole)};
}

}  // namespace color3d
