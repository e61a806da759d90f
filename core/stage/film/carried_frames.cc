#include "core/stage/film/carried_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/stage/film/between_anchors.h"
#include "core/stage/film/frames_of_views.h"

namespace color3d {
CarriedFrames::CarriedFrames(const Scene& scene,
                             const ViewImages& images,
                             const std::vector<ColoredKeyView>& keys,
                             const FilmCarryOptions& options,
                             StageContext& context)
    : scene_(scene),
      folder_(context.scratch_folder() / "carried_frames"),
      has_(scene.views.size(), 0) {
  std::filesystem::create_directories(folder_);
  const std::vector<int> order = scene.ViewsInOrderOfTime();
  std::vector<FilmKey> film_keys;
  for (const ColoredKeyView& key : keys) {
    const auto frame = std::ranges::find(order, key.view) - order.begin();
    film_keys.push_back({static_cast<int>(frame), key.color});
  }
  const auto keep = [&](int frame, const CarriedColor& color) {
    const int view = order[frame];
    WriteFileAtomic(FileOf(view), EncodeAbPng(color.ab, color.confidence));
    has_[view] = 1;
  };
  CarryAlongFilm(FramesOfViews(scene, order, images),
                 film_keys,
                 options,
                 context.pool(),
                 context.cancel(),
                 keep,
                 {},
                 [&](int frame, const CarriedColor& second) {
                   CarriedColor color = Of(order[frame]);
                   if (FillUncertain(second, &color) > 0) keep(frame, color);
                 });
}

std::vector<int> CarriedFrames::NearestTo(int view) const {
  std::map<int, int> nearest;  // by camera
  const auto distance = [&](int other) {
    return std::abs(scene_.views[other].time_s() - scene_.views[view].time_s());
  };
  for (size_t i = 0; i < scene_.views.size(); ++i) {
    if (has_[i] == 0) continue;
    const int other = static_cast<int>(i);
    const auto [it, is_new] = nearest.emplace(scene_.views[i].moment->shot, other);
    if (!is_new && distance(other) < distance(it->second)) it->second = other;
  }
  std::vector<int> frames;
  for (const auto& [camera, frame] : nearest) frames.push_back(frame);
  return frames;
}

CarriedColor CarriedFrames::Of(int view) const {
  const std::filesystem::path file = FileOf(view);
  AbMap map = DecodeAbPng(ReadFile(file), file.filename().string());
  return {std::move(map.ab), std::move(map.confidence)};
}

std::filesystem::path CarriedFrames::FileOf(int view) const {
  return folder_ / fmt::format("{}.png", view);
}

}  // namespace color3d
