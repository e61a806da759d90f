#include "tests/support/scenes/procedural_scene.h"

#include <algorithm>
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
#include "tests/support/scenes/room_views.h"
#include "tests/support/scenes/scene_writers.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {
using Eigen::Vector3d;

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
};

ProceduralScene::ProceduralScene(const ProceduralSceneOptions& options) : options_(options) {
  options_.Validate();
  impl_ = std::make_unique<Impl>(options_.seed);
  AddViews();
  AddSparsePoints();
}

ProceduralScene::~ProceduralScene() = default;

void ProceduralScene::AddViews() {
  for (int i = 0; i < options_.views; ++i) {
    const double t = options_.views > 1 ? 2.0 * i / (options_.views - 1) - 1.0 : 0.0;
    View view = ArcView(t, options_.width, options_.height);
    char name[32];
    std::snprintf(name, sizeof(name), "view%03d.%s", i, options_.jpeg ? "jpg" : "png");
    view.name = name;
    view.image_file = "images/" + view.name;
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
    const double y = random.NextUniform(0.0, options_.height);
    const double x = random.NextUniform(0.0, options_.width);
    const Vector3d direction = RayDirection(from, x, y);
    const Vector3d center = from.cam_from_world.Center();
    const Hit hit = impl_->room.Trace(center, direction);
    if (hit.object < 0) continue;
    SparsePoint point;
    point.position = center + hit.distance * direction;
    point.reprojection_error_px = 0.1;
    for (int v = 0; v < options_.views; ++v) {
      if (Sees(impl_->room, scene_.views[v], point.position)) point.views.push_back(v);
    }
    if (point.views.size() >= needed) scene_.points.push_back(std::move(point));
  }
}

Image ProceduralScene::RenderSrgb(int view_index) const {
  const View& view = scene_.views.at(static_cast<size_t>(view_index));
  const int n = options_.supersampling;
  Image image(view.camera.width, view.camera.height, 3);
  ThreadPool pool(options_.threads);
  pool.ForEach(image.height, [&](int64_t row, int) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < image.width; ++x) {
      Vector3d sum = Vector3d::Zero();
      for (int s = 0; s < n * n; ++s) sum += SampleRoom(impl_->room, view, x, y, {s, n}).color;
      SetPixel(sum / (n * n), y, x, &image);
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
