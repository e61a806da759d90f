#include "core/stage/recolor/time_ranges.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/median.h"
#include "core/stage/formats/key_views.h"

namespace color3d {
namespace {

constexpr double kSameTime = 1e-6;  // times are not exact

// Times at which the film begins and ends, seconds.
struct FilmTime {
  double first_s = 0.0;
  double end_s = 0.0;  // end of its last frame
};

FilmTime TimeOf(const Scene& scene) {
  const std::vector<double> times = scene.Times();
  std::vector<double> steps;
  for (size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return {times.front(), times.back() + (steps.empty() ? 0.0 : Median(std::move(steps)))};
}

std::string RangeText(const RangeKeyView& key) {
  return (key.begin_s ? fmt::format("from {} s ", *key.begin_s) : "from the beginning ") +
         (key.end_s ? fmt::format("to {} s", *key.end_s) : "to the end");
}

bool IsInside(const RangeKeyView& key, double time_s) {
  return time_s >= key.begin_s.value_or(time_s) - kSameTime &&
         time_s <= key.end_s.value_or(time_s) + kSameTime;
}

void CheckRange(const RangeKeyView& key, const View& view, const FilmTime& film) {
  if (key.begin_s && key.end_s && *key.end_s < *key.begin_s) {
    throw InvalidArgument(
        "the range of the key view {} ends at {} s, before it begins at {} s; swap them",
        view.name,
        *key.end_s,
        *key.begin_s);
  }
  if (key.begin_s.value_or(film.first_s) < film.first_s - kSameTime ||
      key.end_s.value_or(film.end_s) > film.end_s + kSameTime ||
      key.begin_s.value_or(film.first_s) > film.end_s ||
      key.end_s.value_or(film.end_s) < film.first_s) {
    throw InvalidArgument(
        "the range of the key view {}, {}, reaches out of the film, which is coloured from {:.3f} "
        "s to {:.3f} s",
        view.name,
        RangeText(key),
        film.first_s,
        film.end_s);
  }
  if (!IsInside(key, view.time_s())) {
    throw InvalidArgument(
        "the key view {} is shown at {:.3f} s, outside of its range, {}; paint a frame inside of "
        "it",
        view.name,
        view.time_s(),
        RangeText(key));
  }
}

void AddTo(std::vector<RecoloredRange>* ranges,
           std::vector<int> views,
           const RecoloredRange::Key& key,
           const Scene& scene) {
  const std::string& name = scene.views[key.view].name;
  for (RecoloredRange& range : *ranges) {
    const bool meet = std::ranges::find_first_of(range.views, views) != range.views.end();
    if (!meet) continue;
    if (range.views != views) {
      throw InvalidArgument(
          "the ranges of the key views {} and {} share some frames of a shot; give both one range, "
          "or end one before the other begins",
          scene.views[range.keys.front().view].name,
          name);
    }
    for (const RecoloredRange::Key& other : range.keys) {
      if (other.view == key.view) {
        throw InvalidArgument("the key view {} is given twice for one range; name it once", name);
      }
    }
    range.keys.push_back(key);
    return;
  }
  ranges->push_back({std::move(views), {key}});
}

}  // namespace

std::vector<RecoloredRange> RangesOf(const std::vector<RangeKeyView>& keys, const Scene& scene) {
  if (const std::string why_not = scene.capture().why_no_time_range; !why_not.empty()) {
    throw InvalidArgument(
        "the key view {} has a range of time, but {}", keys.front().view, why_not);
  }
  const FilmTime film = TimeOf(scene);
  std::vector<RecoloredRange> ranges;
  for (const RangeKeyView& key : keys) {
    const int view = FindAdditionalKeyView(scene, key.view);
    CheckRange(key, scene.views[view], film);
    std::vector<int> views = scene.FramesInShot(view);
    std::erase_if(views, [&](int v) { return !IsInside(key, scene.views[v].time_s()); });
    AddTo(&ranges, std::move(views), {view, &key}, scene);
  }
  return ranges;
}

}  // namespace color3d
