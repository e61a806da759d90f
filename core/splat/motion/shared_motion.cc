#include "core/splat/motion/shared_motion.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "core/splat/model/neighbors.h"
#include "core/splat/motion/motion.h"

namespace color3d {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// In units of GaussianMotion's t. Origin of the time steps; with an even number of them none is at
// 0.
constexpr double kFirstTime = -1.0;
constexpr size_t kFewest = 4;           // neighbours, the Gaussian itself among them
constexpr double kOfAnotherStep = 0.5;  // weight
constexpr double kLeastWeight = 1e-6;   // for Gaussians that no view sees
constexpr double kStiffness = 0.01;     // of the rotation, for neighbours in one line

Vector3d Rows(const ParameterBlock& block, int row, int64_t i) {
  return {block.Row(row)[i], block.Row(row + 1)[i], block.Row(row + 2)[i]};
}

struct Neighbor {
  Vector3d position;
  Vector3d velocity;
  Vector3d acceleration;
  double weight = 0.0;
};

struct RigidMotion {
  Vector3d center = Vector3d::Zero();
  Vector3d velocity = Vector3d::Zero();
  Vector3d turn = Vector3d::Zero();  // axis times radians per unit of time

  Vector3d At(const Vector3d& p) const { return velocity + turn.cross(p - center); }
};

// The least squares fit.
RigidMotion Fit(const std::vector<Neighbor>& neighbors) {
  RigidMotion motion;
  double sum = 0.0;
  for (const Neighbor& n : neighbors) {
    sum += n.weight;
    motion.center += n.weight * n.position;
    motion.velocity += n.weight * n.velocity;
  }
  motion.center /= sum;
  motion.velocity /= sum;
  Matrix3d inertia = Matrix3d::Zero();
  Vector3d momentum = Vector3d::Zero();
  for (const Neighbor& n : neighbors) {
    const Vector3d r = n.position - motion.center;
    inertia += n.weight * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
    momentum += n.weight * r.cross(n.velocity - motion.velocity);
  }
  const double stiffness = kStiffness * inertia.trace() / 3.0;
  if (!(stiffness > 0.0)) return motion;
  inertia.diagonal().array() += stiffness;
  motion.turn = inertia.ldlt().solve(momentum);
  return motion;
}

// Weights down neighbours with a different motion: another object's, or a wrong one.
void DownweightOutliers(const RigidMotion& motion, std::vector<Neighbor>* neighbors) {
  std::vector<double> off;
  for (const Neighbor& n : *neighbors) off.push_back((n.velocity - motion.At(n.position)).norm());
  std::vector<double> sorted = off;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  if (!(*middle > 0.0)) return;
  for (size_t k = 0; k < off.size(); ++k) {
    const double q = off[k] / *middle;
    (*neighbors)[k].weight /= 1.0 + q * q;
  }
}

Vector3d MeanAcceleration(const std::vector<Neighbor>& neighbors) {
  Vector3d sum = Vector3d::Zero();
  double weights = 0.0;
  for (const Neighbor& n : neighbors) {
    sum += n.weight * n.acceleration;
    weights += n.weight;
  }
  return sum / weights;
}

// The Gaussian at its own time, or at `time` if it belongs to another time step.
Neighbor NeighborAt(const ParameterBlock& moving, int row, int64_t i, bool own_step, double time) {
  const Vector3d acceleration = Rows(moving, row + kAccelerationRow, i);
  const Vector3d velocity = Rows(moving, row + kVelocityRow, i);
  const double tau = own_step ? 0.0 : time - moving.Row(row + kCenterRow)[i];
  const double opacity = 1.0 / (1.0 + std::exp(-moving.Row(kOpacityRow)[i]));
  return {Rows(moving, kPositionRow, i) + tau * (velocity + tau * acceleration),
          velocity + 2.0 * tau * acceleration,
          acceleration,
          (own_step ? 1.0 : kOfAnotherStep) * (opacity + kLeastWeight)};
}

void MoveTowards(const Vector3d& to, double share, int row, int64_t i, ParameterBlock& block) {
  for (int k = 0; k < 3; ++k) {
    float& value = block.Row(row + k)[i];
    value += static_cast<float>(share * (to[k] - value));
  }
}

}  // namespace

void ShareMotion(const SharedMotionOptions& options, ThreadPool& pool, ParameterBlock& moving) {
  std::map<int64_t, std::vector<int64_t>> steps;
  for (int64_t i = 0; i < moving.count(); ++i) {
    const double since = moving.Row(options.row + kCenterRow)[i] - kFirstTime;
    steps[std::llround(since / options.interval)].push_back(i);
  }
  const ParameterBlock before = moving;
  for (const auto& step_and_members : steps) {
    const int64_t number = step_and_members.first;
    const std::vector<int64_t>& members = step_and_members.second;
    std::vector<Neighbor> all;  // the members first
    std::vector<NeighborTree::Point> points;
    for (const int64_t step : {number, number - 1, number + 1}) {
      const auto found = steps.find(step);
      if (found == steps.end()) continue;
      const double time = kFirstTime + static_cast<double>(number) * options.interval;
      for (const int64_t i : found->second) {
        all.push_back(NeighborAt(before, options.row, i, step == number, time));
        const Eigen::Vector3f p = all.back().position.cast<float>();
        points.push_back({p.x(), p.y(), p.z()});
      }
    }
    if (all.size() < kFewest) continue;
    const NeighborTree tree(points);
    pool.ForRanges(static_cast<int64_t>(members.size()), [&](int64_t begin, int64_t end, int) {
      std::vector<NeighborTree::Neighbor> nearest;
      std::vector<Neighbor> neighbors;
      for (int64_t m = begin; m < end; ++m) {
        tree.Find(points[m], options.neighbors, nearest);
        neighbors.clear();
        for (const NeighborTree::Neighbor& n : nearest) neighbors.push_back(all[n.index]);
        const Vector3d acceleration = MeanAcceleration(neighbors);
        DownweightOutliers(Fit(neighbors), &neighbors);
        const Vector3d velocity = Fit(neighbors).At(all[m].position);
        const int64_t i = members[m];
        MoveTowards(velocity, options.share, options.row + kVelocityRow, i, moving);
        MoveTowards(acceleration, options.share, options.row + kAccelerationRow, i, moving);
      }
    });
  }
}

}  // namespace color3d
