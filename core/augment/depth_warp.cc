#include "core/augment/depth_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/image/fill_holes.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

// Maximum relative difference of depths of neighbours on one surface. A plane at 80 degrees changes
// by 1.4 % per pixel at a focal length of 400 px.
constexpr float kMaxDepthStep = 0.04f;
constexpr double kMaxStretch = 2.5;      // maximum target area of a source pixel, px
constexpr double kMinDepthShare = 0.02;  // minimum depth, relative to the source
constexpr float kOccludedDepthRatio =
    1.15f;  // relative depth behind the target's surface that counts as occluded

struct Vertex {
  double x = 0.0;  // target px, pixel centres at integers
  double y = 0.0;
  double depth = 0.0;  // 0: none
};

struct Corner {
  const Vertex* vertex = nullptr;
  int x = 0;  // of the source
  int y = 0;
};

class ForwardWarp {
 public:
  ForwardWarp(const DepthView& key, const Pose& target_from_world)
      : key_(key),
        depth_(key.depth.width, key.depth.height, 1, std::numeric_limits<float>::infinity()),
        source_x_(key.depth.width, key.depth.height, 1),
        source_y_(source_x_) {
    Project(target_from_world);
    for (int y = 0; y + 1 < key.depth.height; ++y) {
      for (int x = 0; x + 1 < key.depth.width; ++x) {
        const Corner a = At(x, y), b = At(x + 1, y), c = At(x, y + 1), d = At(x + 1, y + 1);
        Draw({a, b, c});
        Draw({b, d, c});
      }
    }
  }

  // Weight 0 where nothing was drawn or the target sees a nearer surface.
  GeneratedPicture Picture(const Image& target_depth) const {
    GeneratedPicture picture{Image(depth_.width, depth_.height, 3),
                             Image(depth_.width, depth_.height, 1)};
    for (int y = 0; y < depth_.height; ++y) {
      for (int x = 0; x < depth_.width; ++x) {
        const float depth = depth_.At(0, y, x);
        if (!std::isfinite(depth)) continue;
        const float seen = target_depth.Empty() ? 0.0f : target_depth.At(0, y, x);
        if (seen > 0.0f && depth > kOccludedDepthRatio * seen) continue;
        picture.weight.At(0, y, x) = 1.0f;
        for (int c = 0; c < 3; ++c) {
          picture.lab.At(c, y, x) =
              SampleBilinear(key_.lab, c, source_x_.At(0, y, x), source_y_.At(0, y, x));
        }
      }
    }
    return picture;
  }

 private:
  void Project(const Pose& target_from_world) {
    const Camera& camera = key_.camera;
    const Eigen::Quaterniond rotation =
        target_from_world.rotation * key_.cam_from_world.rotation.conjugate();
    const Eigen::Vector3d translation =
        target_from_world.translation - rotation * key_.cam_from_world.translation;
    vertices_.resize(key_.depth.PlaneSize());
    for (int y = 0; y < key_.depth.height; ++y) {
      for (int x = 0; x < key_.depth.width; ++x) {
        const double depth = key_.depth.At(0, y, x);
        if (!(depth > 0.0) || !std::isfinite(depth)) continue;
        const Eigen::Vector3d point = depth * camera.Ray(x + 0.5, y + 0.5);
        const Eigen::Vector3d moved = rotation * point + translation;
        if (!(moved.z() > kMinDepthShare * depth)) continue;
        const Eigen::Vector2d pixel = camera.Project(moved);
        vertices_[Index(x, y)] = {pixel.x() - 0.5, pixel.y() - 0.5, moved.z()};
      }
    }
  }

  size_t Index(int x, int y) const { return static_cast<size_t>(y) * key_.depth.width + x; }
  Corner At(int x, int y) const { return {&vertices_[Index(x, y)], x, y}; }

  bool IsOneSurface(const std::array<Corner, 3>& corners) const {
    float least = std::numeric_limits<float>::max(), most = 0.0f;
    for (const Corner& corner : corners) {
      if (corner.vertex->depth <= 0.0) return false;
      const float depth = key_.depth.At(0, corner.y, corner.x);
      least = std::min(least, depth);
      most = std::max(most, depth);
    }
    return most <= least * (1.0f + kMaxDepthStep);
  }

  void Draw(const std::array<Corner, 3>& corners) {
    if (!IsOneSurface(corners)) return;
    const Vertex &a = *corners[0].vertex, &b = *corners[1].vertex, &c = *corners[2].vertex;
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    // Back-facing, or at a grazing angle that would smear it.
    if (!(area > 0.0) || area > kMaxStretch) return;
    const int x0 = std::max(0, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}))));
    const int y0 = std::max(0, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}))));
    const int x1 =
        std::min(depth_.width - 1, static_cast<int>(std::floor(std::max({a.x, b.x, c.x}))));
    const int y1 =
        std::min(depth_.height - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}))));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const double wb = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / area;
        const double wc = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / area;
        const double wa = 1.0 - wb - wc;
        if (wa < 0.0 || wb < 0.0 || wc < 0.0) continue;
        const auto depth = static_cast<float>(wa * a.depth + wb * b.depth + wc * c.depth);
        if (depth >= depth_.At(0, y, x)) continue;
        depth_.At(0, y, x) = depth;
        source_x_.At(0, y, x) =
            static_cast<float>(wa * corners[0].x + wb * corners[1].x + wc * corners[2].x);
        source_y_.At(0, y, x) =
            static_cast<float>(wa * corners[0].y + wb * corners[1].y + wc * corners[2].y);
      }
    }
  }

  const DepthView& key_;
  std::vector<Vertex> vertices_;
  Image depth_;
  Image source_x_;
  Image source_y_;
};

}  // namespace

GeneratedPicture WarpToView(const DepthView& key,
                            const Pose& target_from_world,
                            const TargetGeometry& geometry) {
  const ForwardWarp warp(key, target_from_world);
  GeneratedPicture picture = warp.Picture(geometry.depth);
  FillHoles(picture.weight, &picture.lab);
  if (geometry.luminance.Empty()) return picture;
  for (size_t i = 0; i < picture.lab.PlaneSize(); ++i) {
    if (picture.weight.data[i] > 0.0f || !(geometry.depth.data[i] > 0.0f)) continue;
    picture.lab.Plane(0)[i] = std::clamp(geometry.luminance.data[i], 0.0f, 100.0f);
  }
  return picture;
}

}  // namespace color3d
