#include "tests/support/scenes/dynamic_scene.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <system_error>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/base/range_check.h"
#include "core/image/codec.h"
#include "tests/support/scenes/scene_writers.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {
using Eigen::Vector3d;

constexpr double kStepSeconds = 0.125;  // exact in binary and in decimals
constexpr double kFar = 1e9;            // m; beyond the closed room

int TimesOf(const DynamicSceneOptions& options) {
  if (options.times > 0) return options.times;
  if (options.which == DynamicCase::kOneStep) return 1;
  return options.which == DynamicCase::kStill ? 8 : 12;
}

DynamicSceneOptions Checked(const DynamicSceneOptions& options) {
  options.Validate();
  return options;
}

}  // namespace

void DynamicSceneOptions::Validate() const {
  DynamicCaseName(which);
  const RangeCheck check("dynamic scene option");
  check("cameras", cameras, 1, 8);
  check("times", times, 0, 1000);
  check("width", width, 16, 512);
  check("height", height, 16, 512);
  check("supersampling", supersampling, 1, 8);
  check("sparse_points", sparse_points, 0, 100000);
  check("threads", threads, 0, 1024);
  if (which == DynamicCase::kOneStep && times > 1) {
    throw InvalidArgument("dynamic scene option times is {}; case one_step has one", times);
  }
}

DynamicScene::DynamicScene(const DynamicSceneOptions& options)
    : options_(Checked(options)), times_(TimesOf(options_)), room_(options_.seed) {
  for (int t = 0; t < times_; ++t) movers_.push_back(MoversAt(options_.which, t, times_));
  AddViews();
  if (!options_.moving_cameras) KeepStillSamples();
  AddSparsePoints();
}

void DynamicScene::AddViews() {
  const double piece = 2.0 / options_.cameras;  // part of the arc of each camera
  for (int c = 0; c < options_.cameras; ++c) {
    const double still = options_.cameras > 1 ? 2.0 * c / (options_.cameras - 1) - 1.0 : 0.0;
    for (int t = 0; t < times_; ++t) {
      const double progress = times_ > 1 ? static_cast<double>(t) / (times_ - 1) : 0.5;
      const double at = options_.moving_cameras ? piece * (c + progress) - 1.0 : still;
      View view = ArcView(at, options_.width, options_.height);
      view.name = fmt::format("cam{:02}/{:04}.png", c, t);
      view.image_file = "images/" + view.name;
      view.moment = Moment{kStepSeconds * t, c};
      scene_.views.push_back(std::move(view));
    }
  }
}

void DynamicScene::KeepStillSamples() {
  const int side = options_.supersampling;
  const size_t per_row = static_cast<size_t>(options_.width) * side * side;
  ThreadPool pool(options_.threads);
  for (int c = 0; c < options_.cameras; ++c) {
    std::vector<RoomSample> samples(per_row * options_.height);
    pool.ForEach(options_.height, [&](int64_t row, int) {
      RoomSample* out = samples.data() + per_row * row;
      for (int x = 0; x < options_.width; ++x) {
        for (int s = 0; s < side * side; ++s) {
          *out++ = SampleRoom(room_, ViewAt(ViewOf(c, 0)), x, static_cast<int>(row), {s, side});
        }
      }
    });
    still_.push_back(std::move(samples));
  }
}

RoomSample DynamicScene::StillSample(int view, int x, int y, int index) const {
  const int side = options_.supersampling;
  if (still_.empty()) return SampleRoom(room_, ViewAt(view), x, y, {index, side});
  const size_t pixel = static_cast<size_t>(y) * options_.width + x;
  return still_[view / times_][pixel * side * side + index];
}

void DynamicScene::AddSparsePoints() {
  Random random(options_.seed, 6);
  const bool places_differ = options_.moving_cameras;
  const int views = static_cast<int>(scene_.views.size());
  const size_t needed = static_cast<size_t>(std::min(3, places_differ ? views : options_.cameras));
  const int tries = 20 * options_.sparse_points;
  for (int i = 0; i < tries && static_cast<int>(scene_.points.size()) < options_.sparse_points;
       ++i) {
    const int from = static_cast<int>(random.NextBelow(static_cast<uint32_t>(views)));
    const double x = random.NextUniform(0.0, options_.width);
    const double y = random.NextUniform(0.0, options_.height);
    const SeenPoint seen = Look(from, x, y);
    if (seen.mover >= 0) continue;
    SparsePoint point;
    point.position = seen.position;
    point.reprojection_error_px = 0.1;
    std::set<int> places;
    for (int v = 0; v < views; ++v) {
      if (!Shows(v, point.position)) continue;
      point.views.push_back(v);
      places.insert(places_differ ? v : v / times_);
    }
    if (places.size() >= needed) scene_.points.push_back(std::move(point));
  }
}

const std::vector<std::optional<Solid>>& DynamicScene::MovingGaussians(int view) const {
  return movers_[view % times_];
}

Hit DynamicScene::TraceMovers(int view,
                              const Vector3d& origin,
                              const Vector3d& direction,
                              double limit) const {
  Hit best, hit;
  best.distance = limit;
  const auto& movers = MovingGaussians(view);
  for (size_t i = 0; i < movers.size(); ++i) {
    if (!movers[i] || movers[i]->Misses(origin, direction)) continue;
    if (!movers[i]->Intersect(origin, direction, &hit) || hit.distance >= best.distance) continue;
    best = hit;
    best.object = static_cast<int>(i);
  }
  return best;
}

Image DynamicScene::RenderSrgb(int view_index) const {
  const View& view = ViewAt(view_index);
  const Vector3d center = view.cam_from_world.Center();
  const int side = options_.supersampling;
  Image image(view.camera.width, view.camera.height, 3);
  ThreadPool pool(options_.threads);
  pool.ForEach(image.height, [&](int64_t row, int) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < image.width; ++x) {
      Vector3d sum = Vector3d::Zero();
      for (int s = 0; s < side * side; ++s) {
        const PixelSample sample{s, side};
        const RoomSample still = StillSample(view_index, x, y, s);
        const Vector3d direction = RayDirection(view, x + sample.x(), y + sample.y());
        const Hit hit = TraceMovers(view_index, center, direction, still.depth);
        if (hit.object < 0) {
          sum += still.color;
          continue;
        }
        sum += PaintedColor(*MovingGaussians(view_index)[hit.object],
                            hit,
                            center + hit.distance * direction,
                            sample.Footprint(view, direction, hit.distance),
                            static_cast<uint32_t>(options_.seed + 1000u * (hit.object + 1)));
      }
      SetPixel(sum / (side * side), y, x, &image);
    }
  });
  return image;
}

SeenPoint DynamicScene::Look(int view_index, double x_px, double y_px) const {
  const View& view = ViewAt(view_index);
  const Vector3d center = view.cam_from_world.Center();
  const Vector3d direction = RayDirection(view, x_px, y_px);
  const Hit hit =
      TraceMovers(view_index, center, direction, room_.Trace(center, direction).distance);
  SeenPoint seen;
  seen.depth = hit.distance;
  seen.position = center + hit.distance * direction;
  if (hit.object >= 0 && IsMoving(options_.which)) {
    seen.mover = hit.object;
    seen.on_mover = MovingGaussians(view_index)[hit.object]->OnMaterial(seen.position);
  }
  return seen;
}

std::optional<Vector3d> DynamicScene::Follow(const SeenPoint& point, int time) const {
  if (point.mover < 0) return point.position;
  const auto& mover = movers_.at(static_cast<size_t>(time)).at(static_cast<size_t>(point.mover));
  if (!mover) return std::nullopt;
  return mover->InWorld(point.on_mover);
}

bool DynamicScene::Shows(int view_index, const Vector3d& position) const {
  const auto pixel = PixelOf(ViewAt(view_index), position);
  if (!pixel) return false;
  const double depth = ViewAt(view_index).cam_from_world.Apply(position).z();
  return std::abs(Look(view_index, pixel->x(), pixel->y()).depth - depth) < 1e-4 * depth;
}

Image DynamicScene::RenderDepth(int view) const {
  Image depth(options_.width, options_.height, 1);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      depth.At(0, y, x) = static_cast<float>(Look(view, x + 0.5, y + 0.5).depth);
    }
  }
  return depth;
}

Image DynamicScene::RenderMovers(int view_index) const {
  const View& view = ViewAt(view_index);
  const Vector3d center = view.cam_from_world.Center();
  const int side = options_.supersampling;
  Image share(options_.width, options_.height, 1);
  if (!IsMoving(options_.which)) return share;
  for (int y = 0; y < share.height; ++y) {
    for (int x = 0; x < share.width; ++x) {
      int moving = 0;
      for (int s = 0; s < side * side; ++s) {
        const PixelSample sample{s, side};
        const Vector3d direction = RayDirection(view, x + sample.x(), y + sample.y());
        const Hit hit = TraceMovers(view_index, center, direction, kFar);
        moving += hit.object >= 0 && hit.distance < room_.Trace(center, direction).distance;
      }
      share.At(0, y, x) = static_cast<float>(moving) / static_cast<float>(side * side);
    }
  }
  return share;
}

void WriteDynamicScene(const fs::path& folder, const DynamicScene& made) {
  for (size_t i = 0; i < made.scene().views.size(); ++i) {
    const fs::path file = folder / made.scene().views[i].image_file;
    std::error_code error;  // ignored: writing reports it
    fs::create_directories(file.parent_path(), error);
    WriteFileAtomic(file, EncodePng8(made.RenderSrgb(static_cast<int>(i))));
  }
  WriteTransformsJson(made.scene(), folder / "transforms.json");
}

}  // namespace color3d
