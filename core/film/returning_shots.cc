#include "core/film/returning_shots.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

#include "core/carry/confidence.h"

namespace color3d {
namespace {

constexpr double kMinFound = 0.15;  // share of the frame

}  // namespace

std::vector<int> UnkeyedShotMiddles(const std::vector<int>& shot, const std::vector<int>& keys) {
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

ReturningShots::ReturningShots(const FilmFrames& frames,
                               const std::vector<FilmKey>& keys,
                               const FilmCarryOptions& options,
                               ThreadPool& pool,
                               const CancellationToken& cancel)
    : frames_(frames),
      keys_(keys),
      options_(options),
      pool_(pool),
      cancel_(cancel),
      pictures_(keys.size()),
      regions_(keys.size()) {
  pool.ForEach(static_cast<int64_t>(keys.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    pictures_[i] = frames.luminance(keys[i].frame);
    regions_[i].emplace(*pictures_[i]);
  });
}

std::optional<FilmKey> ReturningShots::KeyAt(int frame) const {
  const auto luminance = frames_.luminance(frame);
  std::vector<CarriedColor> colors(keys_.size());
  pool_.ForEach(static_cast<int64_t>(keys_.size()), [&](int64_t i, int) {
    cancel_.ThrowIfCancelled();
    colors[i] = CarryIntoReappearing(keys_[i], *regions_[i], *luminance, options_, cancel_);
  });
  std::optional<FilmKey> found;
  double most = kMinFound;
  for (CarriedColor& color : colors) {
    const double share = Coverage(color, kDecisiveConfidence);
    if (share <= most) continue;
    most = share;
    found = {frame, std::move(color)};
  }
  return found;
}

}  // namespace color3d
