#include "tests/support/scenes/procedural_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/base/range_check.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "tests/support/scenes/room.h"
#include "tests/support/scenes/scene_writers.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {
using Eigen::Vector3d;

const Vector3d kTarget(0.0, 0.35, 1.3);
constexpr double kArcRadius = 3.3;
constexpr double kArcHalfAngle = 0.62;  // rad

// World-to-camera pose of an upright camera (the world's y points down).
Pose LookAt(const Vector3d& center, const Vector3d& target) {
  const Vector3d z = (target - center).normalized();
  const Vector3d x = Vector3d::UnitY().cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  Pose pose;
  pose.rotation = Eigen::Quaterniond(rotation).normalized();
  pose.translation = -(pose.rotation * center);
  return pose;
}

float GammaEncode(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return static_cast<float>(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055);
}

// Direction through a pixel position, with z = 1 in the camera's frame.
Vector3d RayDirection(const View& view, double x, double y) {
  return view.cam_from_world.rotation.conjugate() * view.camera.Ray(x, y);
}

}  // namespace

void ProceduralSceneOptions::Validate() const {
  const RangeCheck check("procedural scene option");
  check("views", views, 1, 1000);
  check("width", width, 16, 8192);
  check("height", height, 16, 8192);
  check("supersampling", supersampling, 1, 8);
  check("sparse_points", sparse_points, 0, 1000000);
  check("threads", threads, 0, 1024);
}

struct ProceduralScene::Impl {
  explicit Impl(uint64_t seed) : room(seed) {}
  Room room;

  // True when nothing lies between the camera and the point.
  bool Sees(const View& view, const Vector3d& point) const {
    const Vector3d p = view.cam_from_world.Apply(point);
    if (p.z() <= 0.0) return false;
    const Eigen::Vector2d pixel = view.camera.Project(p);
    if (!view.camera.Contains(pixel)) return false;
    const Hit hit =
        room.Trace(view.cam_from_world.Center(), RayDirection(view, pixel.x(), pixel.y()));
    return hit.object >= 0 && std::abs(hit.distance - p.z()) < 1e-4 * p.z();
  }
};

ProceduralScene::ProceduralScene(const ProceduralSceneOptions& options) : options_(options) {
  options_.Validate();
  impl_ = std::make_unique<Impl>(options_.seed);
  AddViews();
  AddSparsePoints();
}

ProceduralScene::~ProceduralScene() = default;

void ProceduralScene::AddViews() {
  const double focal = 0.8 * std::max(options_.width, options_.height);
  for (int i = 0; i < options_.views; ++i) {
    View view;
    char name[32];
    std::snprintf(name, sizeof(name), "view%03d.%s", i, options_.jpeg ? "jpg" : "png");
    view.name = name;
    view.image_file = "images/" + view.name;
    view.captured_camera = {
        options_.width, options_.height, focal, focal, 0.5 * options_.width, 0.5 * options_.height};
    view.camera = view.captured_camera;
    const double t = options_.views > 1 ? 2.0 * i / (options_.views - 1) - 1.0 : 0.0;
    const double angle = kArcHalfAngle * t;
    // A camera carried by hand: its height and distance vary smoothly along the arc.
    const double radius = kArcRadius * (1.0 + 0.06 * std::sin(5.0 * t + 1.0));
    const Vector3d center(kTarget.x() + radius * std::sin(angle),
                          -0.25 + 0.28 * std::sin(4.0 * t),
                          kTarget.z() - radius * std::cos(angle));
    view.cam_from_world = LookAt(center, kTarget + Vector3d(0.25 * std::sin(7.0 * t), 0.0, 0.0));
    scene_.views.push_back(std::move(view));
  }
}

void ProceduralScene::AddSparsePoints() {
  Random random(options_.seed, 5);
  const size_t needed = static_cast<size_t>(std::min(3, options_.views));
  const int tries = 20 * options_.sparse_points;
  for (int i = 0; i < tries && static_cast<int>(scene_.points.size()) < options_.sparse_points;
       ++i) {
    const View& from = scene_.views[random.NextBelow(static_cast<uint32_t>(options_.views))];
    const Vector3d direction = RayDirection(
        from, random.NextUniform(0.0, options_.width), random.NextUniform(0.0, options_.height));
    const Vector3d center = from.cam_from_world.Center();
    const Hit hit = impl_->room.Trace(center, direction);
    if (hit.object < 0) continue;
    SparsePoint point;
    point.position = center + hit.distance * direction;
    point.reprojection_error_px = 0.1;
    for (int v = 0; v < options_.views; ++v) {
      if (impl_->Sees(scene_.views[v], point.position)) point.views.push_back(v);
    }
    if (point.views.size() >= needed) scene_.points.push_back(std::move(point));
  }
}

Image ProceduralScene::RenderSrgb(int view_index) const {
  const View& view = scene_.views.at(static_cast<size_t>(view_index));
  const Vector3d center = view.cam_from_world.Center();
  const int n = options_.supersampling;
  const double footprint_per_m = 1.0 / (view.camera.fx * n);
  Image image(view.camera.width, view.camera.height, 3);
  ThreadPool pool(options_.threads);
  pool.ForEach(image.height, [&](int64_t row, int) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < image.width; ++x) {
      Vector3d sum = Vector3d::Zero();
      for (int s = 0; s < n * n; ++s) {
        const double sx = (s % n + 0.5) / n, sy = (s / n + 0.5) / n;
        const Vector3d direction = RayDirection(view, x + sx, y + sy);
        const Hit hit = impl_->room.Trace(center, direction);
        const double footprint = hit.distance * footprint_per_m * direction.norm();
        // The lamp's samples in another order than the pixel's, so that they are not correlated.
        const int lamp = (s * (n + 1)) % (n * n);
        sum += impl_->room.Radiance(hit,
                                    center + hit.distance * direction,
                                    footprint,
                                    (lamp % n + 0.5) / n,
                                    (lamp / n + 0.5) / n);
      }
      sum /= n * n;
      for (int c = 0; c < 3; ++c) image.At(c, y, x) = GammaEncode(sum[c]);
    }
  });
  return image;
}

Image ProceduralScene::RenderDepth(int view_index) const {
  const View& view = scene_.views.at(static_cast<size_t>(view_index));
  const Vector3d center = view.cam_from_world.Center();
  Image depth(view.camera.width, view.camera.height, 1);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      const Hit hit = impl_->room.Trace(center, RayDirection(view, x + 0.5, y + 0.5));
      depth.At(0, y, x) = static_cast<float>(hit.distance);
    }
  }
  return depth;
}

void WriteProceduralScene(const fs::path& folder, const ProceduralSceneOptions& options) {
  const ProceduralScene room(options);
  const auto encode = [&options](const Image& image) {
    return options.jpeg ? EncodeJpeg(image, 95) : EncodePng8(image);
  };
  fs::create_directories(folder / "images");
  if (options.gray) fs::create_directories(folder / "truth");
  for (size_t i = 0; i < room.scene().views.size(); ++i) {
    const View& view = room.scene().views[i];
    Image picture = room.RenderSrgb(static_cast<int>(i));
    if (options.gray) {
      WriteFileAtomic(folder / "truth" / view.name, encode(picture));
      Image gray = LuminanceFromSrgb(picture);
      for (float& v : gray.data) v = static_cast<float>(GrayFromLuminance(v));
      picture = std::move(gray);
    }
    WriteFileAtomic(folder / view.image_file, encode(picture));
  }
  if (options.poses == ProceduralSceneOptions::Poses::kColmap) {
    WriteColmapText(room.scene(), folder / "sparse" / "0");
  } else if (options.poses == ProceduralSceneOptions::Poses::kTransforms) {
    WriteTransformsJson(room.scene(), folder / "transforms.json");
  }
}

}  // namespace color3d
