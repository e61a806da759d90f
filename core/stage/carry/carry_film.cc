#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "core/film/film_carry.h"
#include "core/film/returning_shots.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/carry/automatic_colors.h"
#include "core/stage/carry/carry_by_kind.h"
#include "core/stage/carry/carry_results.h"
#include "core/stage/film/between_anchors.h"
#include "core/stage/film/frames_of_views.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_checkpoint.h"
#include "core/stage/formats/key_views.h"

namespace color3d {
namespace {

constexpr int64_t kCacheBytes = int64_t{8} << 20;  // each frame is read once, in order

std::vector<int> FramesOf(const std::vector<FilmKey>& keys) {
  std::vector<int> frames;
  for (const FilmKey& key : keys) frames.push_back(key.frame);
  return frames;
}

// Colours that the key view of its shot nearest to `frame` gives it; empty where there is none.
CarriedColor CarriedToFrame(const FilmFrames& frames,
                            const std::vector<FilmKey>& keys,
                            int frame,
                            const FilmCarryOptions& options,
                            StageContext& context) {
  CarriedColor color;
  const int nearest = NearestKeyFrames(frames, FramesOf(keys))[frame].nearest;
  if (nearest < 0) return color;
  // The walk is limited to the frames between: every other one is a shot of its own.
  FilmFrames between = frames;
  for (int i = 0; i < static_cast<int>(between.shot.size()); ++i) {
    if (i < std::min(frame, nearest) || i > std::max(frame, nearest)) {
      between.shot[i] = -1 - i;
    }
  }
  CarryAlongFilm(between,
                 {*std::ranges::find(keys, nearest, &FilmKey::frame)},
                 options,
                 context.pool(),
                 context.cancel(),
                 {[&](int at, const CarriedColor& carried) {
                   if (at == frame) color = carried;
                 }});
  return color;
}

// The key views with their colours. An additional one has its unpainted parts from those before it.
std::vector<FilmKey> ReadFilmKeys(const CarryInputs& inputs,
                                  const FilmFrames& frames,
                                  const ViewImages& images,
                                  StageContext& context) {
  std::vector<FilmKey> keys;
  for (const int view : inputs.key_views) {
    FilmKey key{view, {}};
    if (keys.empty()) {
      const Camera camera = images.WorkingCamera(view);
      key.color = ReadKeyColor(context, camera.width, camera.height);
    } else {
      key.color = ReadAdditionalKeyColor(context, inputs.scene, view, images);
      const CarriedColor before = CarriedToFrame(frames, keys, view, inputs.options.film, context);
      if (!before.ab.Empty()) FillFrom(before, &key.color);
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

// Key frames of shots in which nobody has chosen one.
class UnkeyedShots {
 public:
  // The references must outlive the object.
  UnkeyedShots(const FilmFrames& frames,
               const std::vector<FilmKey>& keys,
               const FilmCarryOptions& options,
               StageContext& context)
      : frames_(frames),
        returning_(frames, keys, options, context.pool(), context.cancel()),
        colorizer_(ColorizerOfKeyView(context)) {}

  // The frame in the colours of a key frame whose place it shows again, else in automatic ones if
  // those of the key view are automatic; nullopt: in none.
  std::optional<FilmKey> KeyAt(int frame) const {
    std::optional<FilmKey> key = returning_.KeyAt(frame);
    if (key || !colorizer_) return key;
    AutomaticColor color = colorizer_->Colorize(*frames_.luminance(frame));
    return FilmKey{frame, {std::move(color.ab), std::move(color.confidence)}};
  }

 private:
  const FilmFrames& frames_;
  ReturningShots returning_;
  std::shared_ptr<const AutomaticColorizer> colorizer_;
};

}  // namespace

void CarryFilm(const CarryInputs& inputs, StageContext& context) {
  const CarryColorOptions& options = inputs.options;
  const ViewImages images(inputs.scene, context.scene_folder(), options.max_side_px, kCacheBytes);
  std::vector<int> views(inputs.scene.views.size());
  std::iota(views.begin(), views.end(), 0);
  const FilmFrames frames = FramesOfViews(inputs.scene, views, images);
  const std::vector<FilmKey> keys = ReadFilmKeys(inputs, frames, images, context);
  CarryCheckpoint done(inputs.scene, context);
  const FilmResume resume{done.Walks(), [&](const FilmWalk& walk) { done.SetWalk(walk); }};
  const auto add = [&](int frame, const CarriedColor& color) {
    if (done.WasDone(frame)) return;
    done.Add(frame, CoveredShare(color), EncodeAbPng(color.ab, color.confidence));
  };
  const auto fill = [&](int frame, const CarriedColor& second) {
    AbMap map = DecodeAbPng(done.Png(frame), artifact::kCarried);
    CarriedColor color{std::move(map.ab), std::move(map.confidence)};
    if (FillUncertain(second, &color) == 0) return;
    done.Replace(frame, CoveredShare(color), EncodeAbPng(color.ab, color.confidence));
  };
  const auto carry = [&](const std::vector<FilmKey>& from) {
    CarryAlongFilm(
        frames, from, options.film, context.pool(), context.cancel(), {add, fill}, resume);
  };
  carry(keys);
  const std::vector<int> middles = UnkeyedShotMiddles(frames.shot, inputs.key_views);
  std::optional<UnkeyedShots> unkeyed;
  for (size_t i = 0; i < middles.size(); ++i) {
    done.ReportProgress(
        fmt::format("colouring a key frame of shot {} of {} without one", i + 1, middles.size()));
    if (!unkeyed) unkeyed.emplace(frames, keys, options.film, context);
    const auto key = unkeyed->KeyAt(middles[i]);
    if (key) carry({*key});
  }
  WarnOfSmallCoverage(WriteCoverage(inputs, done.coverage(), context), context);
}

}  // namespace color3d
