#include "core/film/returning_shots.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

namespace color3d {
namespace {

constexpr float kFound = 0.5f;        // confidence
constexpr double kLeastFound = 0.15;  // share of the frame

}  // namespace

std::vector<int> MiddlesWithoutKey(const std::vector<int>& shot, const std::vector<int>& keys) {
  std::map<int, std::vector<int>> shots;
  for (size_t i = 0; i < shot.size(); ++i) shots[shot[i]].push_back(static_cast<int>(i));
  for (const int key : keys) shots.erase(shot[key]);
  std::vector<int> middles;
  for (const auto& [number, frames] : shots) {
    if (frames.size() > 1) middles.push_back(frames[frames.size() / 2]);
  }
  std::sort(middles.begin(), middles.end());
  return middles;
}

std::optional<FilmKey> KeyOfReturningShot(const FilmFrames& frames,
                                          int frame,
                                          const std::vector<FilmKey>& keys,
                                          const FilmCarryOptions& options,
                                          ThreadPool& pool,
                                          const CancellationToken& cancel) {
  const auto luminance = frames.luminance(frame);
  std::vector<CarriedColor> colors(keys.size());
  pool.ForEach(static_cast<int64_t>(keys.size()), [&](int64_t i, int) {
    colors[i] =
        CarryFoundAgain(keys[i], *frames.luminance(keys[i].frame), *luminance, options, cancel);
  });
  std::optional<FilmKey> found;
  double most = kLeastFound;
  for (CarriedColor& color : colors) {
    const double share = Coverage(color, kFound);
    if (share <= most) continue;
    most = share;
    found = {frame, std::move(color)};
  }
  return found;
}

}  // namespace color3d
