// Ray caster of a textured room corner with a moving board: films and photos for
// structure-from-motion.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/base/image.h"
#include "core/scene/camera.h"

namespace color3d {

// Noise of many scales on a plane, 0..1, with features for SIFT.
inline float CornerTexture(double u, double v, uint32_t plane) {
  const auto lattice = [plane](int64_t x, int64_t y, int octave) {
    uint64_t h = static_cast<uint64_t>(x) * 0x9E3779B97F4A7C15ULL ^
                 static_cast<uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL ^ (plane * 977u + octave * 131u);
    h ^= h >> 29;
    h *= 0xBF58476D1CE4E5B9ULL;
    h ^= h >> 32;
    return static_cast<double>(h & 0xFFFFu) / 65535.0;
  };
  double sum = 0.0;
  double weight = 0.3;
  double scale = 2.0;
  for (int octave = 0; octave < 5; ++octave, scale *= 2.1, weight *= 0.85) {
    const double x = u * scale;
    const double y = v * scale;
    const int64_t ix = static_cast<int64_t>(std::floor(x));
    const int64_t iy = static_cast<int64_t>(std::floor(y));
    const double fx = x - ix;
    const double fy = y - iy;
    sum += weight *
           ((1 - fy) * ((1 - fx) * lattice(ix, iy, octave) + fx * lattice(ix + 1, iy, octave)) +
            fy * ((1 - fx) * lattice(ix, iy + 1, octave) + fx * lattice(ix + 1, iy + 1, octave)));
  }
  return static_cast<float>(std::clamp(1.4 * sum - 0.25, 0.0, 1.0));
}

// Upright, facing the camera, in the plane z = center.z, with a texture that moves along.
struct MovingBoard {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double half_width = 0.25, half_height = 0.4;
};

struct CornerRay {
  float value = 0.0f;  // 0..1
  bool moves = false;  // hits the board
};

// Surface hit by a ray: floor y = 1, wall z = 2, wall x = -1.5, or the board in front of them.
inline CornerRay TraceCorner(const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction,
                             const std::optional<MovingBoard>& board = {}) {
  double nearest = 1e9;
  CornerRay ray;
  const double walls[3] = {-1.5, 1.0, 2.0};
  for (int axis = 0; axis < 3; ++axis) {
    const double t = (walls[axis] - origin[axis]) / direction[axis];
    if (!(t > 1e-6 && t < nearest)) continue;
    nearest = t;
    const Eigen::Vector3d hit = origin + t * direction;
    ray.value =
        CornerTexture(hit[(axis + 1) % 3], hit[(axis + 2) % 3], static_cast<uint32_t>(axis));
  }
  if (!board) return ray;
  const double t = (board->center.z() - origin.z()) / direction.z();
  const Eigen::Vector3d hit = origin + t * direction - board->center;
  if (t > 1e-6 && t < nearest && std::abs(hit.x()) < board->half_width &&
      std::abs(hit.y()) < board->half_height) {
    ray = {CornerTexture(1.5 * hit.x() + 7.0, 1.5 * hit.y() + 3.0, 9), true};
  }
  return ray;
}

// 1 channel, 0..1.
inline Image RenderCorner(const Camera& camera,
                          const Pose& pose,
                          const std::optional<MovingBoard>& board = {}) {
  Image image(camera.width, camera.height, 1);
  const Eigen::Vector3d origin = pose.Center();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      float sum = 0.0f;
      for (int s = 0; s < 4; ++s) {
        const Eigen::Vector3d ray = camera.Ray(x + 0.25 + 0.5 * (s % 2), y + 0.25 + 0.5 * (s / 2));
        sum += 0.25f * TraceCorner(origin, pose.rotation.conjugate() * ray, board).value;
      }
      image.At(0, y, x) = sum;
    }
  }
  return image;
}

// 1 channel: 1 on the board, else 0.
inline Image MaskOfBoard(const Camera& camera, const Pose& pose, const MovingBoard& board) {
  Image image(camera.width, camera.height, 1);
  const Eigen::Vector3d origin = pose.Center();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = pose.rotation.conjugate() * camera.Ray(x + 0.5, y + 0.5);
      image.At(0, y, x) = TraceCorner(origin, ray, board).moves ? 1.0f : 0.0f;
    }
  }
  return image;
}

}  // namespace color3d
