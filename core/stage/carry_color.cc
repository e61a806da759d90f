#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/range_check.h"
#include "core/carry/carry_views.h"
#include "core/film/film_carry.h"
#include "core/film/returning_shots.h"
#include "core/image/codec.h"
#include "core/scene/photo_masks.h"
#include "core/scene/view_images.h"
#include "core/splat/raster/render.h"
#include "core/stage/film/between_anchors.h"
#include "core/stage/film/carried_frames.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_checkpoint.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/further_colors.h"

namespace color3d {
namespace {

constexpr float kCovered = 0.25f;        // confidence from which a pixel counts as covered
constexpr double kSmallCoverage = 0.01;  // below, the user is told
constexpr size_t kMaxFurtherKeyViews = 16;
// Of decoded pictures, each of two sizes: neighbours in space are read again and again; of a scene
// that moves these are the few of one moment.
constexpr int64_t kPhotosCacheBytes = int64_t{1} << 30;
constexpr int64_t kFramesCacheBytes = int64_t{64} << 20;

// `taken`: the key views before it.
int FurtherView(const FurtherKeyView& further, const std::vector<int>& taken, const Scene& scene) {
  const int view = ViewOfFurther(further, scene);
  if (further.HasRange()) {
    throw InvalidArgument(
        "the key view {} has a range of time; such key views are corrections of the coloured film, "
        "not carried with the others",
        scene.views[view].name);
  }
  if (std::find(taken.begin(), taken.end(), view) != taken.end()) {
    throw InvalidArgument("the view {} is a key view already; name each once",
                          scene.views[view].name);
  }
  return view;
}

template <class Key>
std::vector<int> ViewsOf(const std::vector<Key>& keys, int Key::*view) {
  std::vector<int> views;
  for (const Key& key : keys) views.push_back(key.*view);
  return views;
}

std::vector<ColoredKeyView> ColorKeyViews(const CarryColorOptions& options,
                                          const Scene& scene,
                                          const ViewImages& images,
                                          const SurfaceMaker& maker,
                                          StageContext& context) {
  std::vector<ColoredKeyView> keys(1);
  keys[0].view = ReadKeyView(context, scene);
  keys[0].surfaces = maker.Make(keys[0].view);
  const Camera& camera = keys[0].surfaces.rendered.camera;
  keys[0].color = ReadKeyColor(context, camera.width, camera.height);
  ClearMasked(images.Mask(keys[0].view).get(), &keys[0].color.confidence);
  for (const FurtherKeyView& further : options.further) {
    context.cancel().ThrowIfCancelled();
    ColoredKeyView key;
    key.view = FurtherView(further, ViewsOf(keys, &ColoredKeyView::view), scene);
    key.surfaces = maker.Make(key.view);
    // What the views before it have given stays; the user's colours fill the rest.
    key.color = CarryFromAll(keys, key.surfaces, options.carry);
    FillFrom(ColorOfFurther(further, key.view, scene, images, context), &key.color);
    keys.push_back(std::move(key));
  }
  return keys;
}

// Mean over the views that are not key views.
double MeanCoverage(const std::vector<double>& coverage, const std::vector<int>& key_views) {
  double sum = 0.0;
  for (size_t i = 0; i < coverage.size(); ++i) {
    if (std::find(key_views.begin(), key_views.end(), static_cast<int>(i)) == key_views.end()) {
      sum += coverage[i];
    }
  }
  const size_t others = coverage.size() - key_views.size();
  return others > 0 ? sum / static_cast<double>(others) : 1.0;
}

// carry.json, and a warning when the key views show next to nothing of the others.
void Conclude(const Scene& scene,
              const std::vector<int>& key_views,
              const std::vector<double>& coverage,
              StageContext& context) {
  CarryFacts facts;
  for (const int view : key_views) facts.key_views.push_back(scene.views[view].name);
  const double mean = MeanCoverage(coverage, key_views);
  facts.coverage = mean;
  for (size_t i = 0; i < coverage.size(); ++i) {
    facts.view_coverage[scene.views[i].name] = coverage[i];
  }
  context.progress().OnError(0, "coverage", mean);
  if (mean < kSmallCoverage) {
    context.progress().OnWarning(
        fmt::format("the key view shows only {:.1f} % of what the other views show; their colours "
                    "are inferred from likeness. Colour a second key view, or choose another one",
                    100.0 * mean));
  }
  WriteCarryFacts(facts, context);
}

// Into a view of a scene that moves: by motion within the camera of a key view, from that camera's
// frame of the same time through the geometry of that time, and where neither knows, from the key
// views themselves as if nothing had moved (what did is told apart by depth and luminance).
CarriedColor CarryInTime(const std::vector<ColoredKeyView>& keys,
                         const FramesInColor& frames,
                         const SurfaceMaker& maker,
                         int view,
                         const CarryOptions& options) {
  const ViewSurfaces target = maker.Make(view);
  CarriedColor color;
  if (frames.Has(view)) {
    color = frames.Of(view);
  } else {
    std::vector<ColoredKeyView> sources;
    for (const int frame : frames.NearestTo(view)) {
      sources.push_back({frame, maker.Make(frame), frames.Of(frame)});
    }
    color = CarryFromAll(sources, target, options);
  }
  FillFrom(CarryFromAll(keys, target, options), &color);
  return color;
}

// What the key frames before it give a frame that is to be one: from the nearest of its shot.
CarriedColor CarriedToFrame(const FilmFrames& frames,
                            const std::vector<FilmKey>& keys,
                            int frame,
                            const FilmCarryOptions& options,
                            StageContext& context) {
  CarriedColor color;
  const int nearest = NearestKeyFrames(frames, ViewsOf(keys, &FilmKey::frame))[frame].nearest;
  if (nearest < 0) return color;
  // Only the frames between are walked along.
  FilmFrames between = frames;
  for (int i = 0; i < static_cast<int>(between.shot.size()); ++i) {
    if (i < std::min(frame, nearest) || i > std::max(frame, nearest)) {
      between.shot[i] = -1 - i;
    }
  }
  CarryAlongFilm(
      between,
      {*std::find_if(
          keys.begin(), keys.end(), [&](const FilmKey& key) { return key.frame == nearest; })},
      options,
      context.pool(),
      context.cancel(),
      [&](int at, const CarriedColor& carried) {
        if (at == frame) color = carried;
      });
  return color;
}

// The key frames' colours along the film, by motion in place of geometry.
void CarryByMotion(const CarryColorOptions& options, const Scene& scene, StageContext& context) {
  constexpr int64_t kCacheBytes = int64_t{8} << 20;  // each frame is read once, in order
  const ViewImages images(scene, context.scene_folder(), options.max_side_px, kCacheBytes);
  FilmFrames frames;
  for (const View& view : scene.views) {
    frames.shot.push_back(view.moment->shot);
    frames.time_s.push_back(view.time_s());
  }
  frames.luminance = [&](int frame) { return images.Luminance(frame); };
  const Camera camera = images.WorkingCamera(0);
  std::vector<FilmKey> keys(1);
  keys[0].frame = ReadKeyView(context, scene);
  keys[0].color = ReadKeyColor(context, camera.width, camera.height);
  for (const FurtherKeyView& further : options.further) {
    const int view = FurtherView(further, ViewsOf(keys, &FilmKey::frame), scene);
    FilmKey key{view, ColorOfFurther(further, view, scene, images, context)};
    // What is not painted keeps the colours that it had: a later key frame may mend a part.
    const CarriedColor before = CarriedToFrame(frames, keys, view, options.film, context);
    if (!before.ab.Empty()) FillFrom(before, &key.color);
    keys.push_back(std::move(key));
  }
  CarryCheckpoint done(scene, context);
  const FilmResume resume{done.Walks(), [&](const FilmWalk& walk) { done.SetWalk(walk); }};
  const auto add = [&](int frame, const CarriedColor& color) {
    if (done.WasDone(frame)) return;
    done.Add(frame, Coverage(color, kCovered), EncodeAbPng(color.ab, color.confidence));
  };
  const auto fill = [&](int frame, const CarriedColor& second) {
    AbMap map = DecodeAbPng(done.Png(frame), artifact::kCarried);
    CarriedColor color{std::move(map.ab), std::move(map.confidence)};
    if (FillOpen(second, &color) == 0) return;
    done.Replace(frame, Coverage(color, kCovered), EncodeAbPng(color.ab, color.confidence));
  };
  const auto carry = [&](const std::vector<FilmKey>& from) {
    CarryAlongFilm(frames, from, options.film, context.pool(), context.cancel(), add, resume, fill);
  };
  carry(keys);
  const std::vector<int> key_views = ViewsOf(keys, &FilmKey::frame);
  const std::vector<int> middles = MiddlesWithoutKey(frames.shot, key_views);
  std::optional<ReturningShots> returning;
  for (size_t i = 0; i < middles.size(); ++i) {
    done.Tell(fmt::format(
        "looking for what key frames show in shot {} of {} that have none", i + 1, middles.size()));
    if (!returning) {
      returning.emplace(frames, keys, options.film, context.pool(), context.cancel());
    }
    const auto key = returning->KeyAt(middles[i]);
    if (key) carry({*key});
  }
  Conclude(scene, key_views, done.coverage(), context);
}

// Frames of a place where nothing moves are photos of it.
void ForgetTimes(Scene& scene) {
  for (View& view : scene.views) view.moment.reset();
}

}  // namespace

void CarryColorOptions::Validate() const {
  CheckMaxSide(max_side_px);
  const RangeCheck check("carry option");
  check("depth_side_px", depth_side_px, 64, 2048);
  check("depth_sources", depth_sources, 1, kMaxSweepSources);
  if (further.size() > kMaxFurtherKeyViews) {
    throw InvalidArgument("{} further key views were given; at most {} are taken",
                          further.size(),
                          kMaxFurtherKeyViews);
  }
  sweep.Validate();
  carry.Validate();
  film.Validate();
}

void RunCarryColor(const CarryColorOptions& options, StageContext& context) {
  options.Validate();
  Scene scene = ReadScene(context);
  if (IsColoredAsFilm(context, scene)) return CarryByMotion(options, scene, context);
  const GaussianModel geometry = ParseGaussians(context.ReadInput(artifact::kGeometry));
  // Of photos and of those for depth, each.
  const int64_t cache_bytes = std::min(scene.IsDynamic() ? kFramesCacheBytes : kPhotosCacheBytes,
                                       context.MemoryBytes() / 4);
  if (geometry.motion.size() == 0) ForgetTimes(scene);
  const ViewImages images(scene, context.scene_folder(), options.max_side_px, cache_bytes);
  const ViewImages sweep_images(scene, context.scene_folder(), options.depth_side_px, cache_bytes);
  const SurfaceRenderer render = [&](int index, const Camera& camera) {
    ThreadPool one(1);
    const View& view = scene.views[index];
    RenderedView seen = RenderView(geometry, camera, view.cam_from_world, one, 0.0f, view.time_s());
    return RenderedSurface{std::move(seen.median_depth), std::move(seen.opacity)};
  };
  const SurfaceMaker maker(
      scene, images, sweep_images, render, options.depth_sources, options.sweep, context.cancel());
  const std::vector<ColoredKeyView> keys = ColorKeyViews(options, scene, images, maker, context);

  std::optional<FramesInColor> frames;
  if (scene.IsDynamic()) frames.emplace(scene, images, keys, options.film, context);
  CarryCheckpoint done(scene, context);
  const std::vector<int> order = scene.ViewsInOrderOfTime();  // those of one moment share frames
  context.pool().ForEach(static_cast<int64_t>(order.size()), [&](int64_t index, int) {
    context.cancel().ThrowIfCancelled();
    const int view = order[index];
    if (done.WasDone(view)) return;
    const auto key = std::find_if(
        keys.begin(), keys.end(), [&](const ColoredKeyView& k) { return k.view == view; });
    const CarriedColor carried = key != keys.end() ? key->color
                                 : frames ? CarryInTime(keys, *frames, maker, view, options.carry)
                                          : CarryFromAll(keys, maker.Make(view), options.carry);
    done.Add(view,
             key != keys.end() ? 1.0 : Coverage(carried, kCovered),
             EncodeAbPng(carried.ab, carried.confidence));
  });
  Conclude(scene, ViewsOf(keys, &ColoredKeyView::view), done.coverage(), context);
}

}  // namespace color3d
