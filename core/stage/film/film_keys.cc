#include "core/stage/film/film_keys.h"

#include <algorithm>
#include <map>
#include <set>

#include "core/base/error.h"
#include "core/film/returning_shots.h"
#include "core/scene/view_images.h"

namespace color3d {
namespace {

constexpr int kReturnSidePx = 500;  // as carry_color's frames

// All views of a shot, ascending.
struct Shot {
  int number = 0;
  std::vector<int> views;
};

// Shots, the longest first. Those of one frame (torn, blank) only where there are no others.
std::vector<Shot> ShotsOf(const Scene& scene) {
  std::map<int, Shot> by_number;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    Shot& shot = by_number[scene.views[i].moment->shot];
    shot.number = scene.views[i].moment->shot;
    shot.views.push_back(static_cast<int>(i));
  }
  std::vector<Shot> shots, single;
  for (auto& [number, shot] : by_number) {
    (shot.views.size() > 1 ? shots : single).push_back(std::move(shot));
  }
  if (shots.empty()) shots = std::move(single);
  std::ranges::stable_sort(
      shots, std::ranges::greater(), [](const Shot& shot) { return shot.views.size(); });
  return shots;
}

std::vector<int> TrainingViewsOf(const Shot& shot, const Scene& scene) {
  std::vector<int> views;
  for (const int view : shot.views) {
    if (!scene.views[view].held_out) views.push_back(view);
  }
  return views;
}

// Numbers of key frames of a shot.
struct ShotKeys {
  int possible = 0;
  int own = 0;
  // True if it shows the place of a shot with a key frame again; nullopt: not known yet.
  std::optional<bool> returns;

  int Serving() const { return std::max(own, returns.value_or(false) ? 1 : 0); }
};

// Shot of the next key frame: the longest one without any, else the one with most frames for each.
// -1: every shot is full.
int NextShot(const std::vector<Shot>& shots, const std::vector<ShotKeys>& keys) {
  int next = -1;
  const auto frames_for_each = [&](int i) {
    return static_cast<double>(shots[i].views.size()) / (keys[i].Serving() + 1);
  };
  const auto unserved = [&](int i) { return keys[i].Serving() == 0; };
  for (int i = 0; i < static_cast<int>(shots.size()); ++i) {
    if (keys[i].own >= keys[i].possible) continue;
    if (next < 0 || unserved(i) > unserved(next) ||
        (unserved(i) == unserved(next) && frames_for_each(i) > frames_for_each(next))) {
      next = i;
    }
  }
  return next;
}

int MiddleOf(const Shot& shot) { return shot.views[shot.views.size() / 2]; }

// True if the middle of `shot` shows the place of the middle of one of `others`, by the same search
// as in carry_color.
bool Returns(const Shot& shot,
             const std::vector<const Shot*>& others,
             const ViewImages& images,
             StageContext& context) {
  const FilmFrames frames{{}, [&](int frame) { return images.Luminance(frame); }, nullptr};
  std::vector<FilmKey> keys;
  for (const Shot* other : others) {
    const int frame = MiddleOf(*other);
    const auto luminance = images.Luminance(frame);
    keys.push_back({frame,
                    {Image(luminance->width, luminance->height, 2),
                     Image(luminance->width, luminance->height, 1, 1.0f)}});
  }
  return ReturningShots(frames, keys, {}, context.pool(), context.cancel())
      .KeyAt(MiddleOf(shot))
      .has_value();
}

}  // namespace

std::vector<int> CandidatesOfFilm(const Scene& scene, const std::string& named) {
  constexpr size_t kMaxCandidates = 60;
  const std::vector<Shot> shots = ShotsOf(scene);
  std::vector<int> from;
  for (const Shot& shot : shots) {
    const std::vector<int> training = TrainingViewsOf(shot, scene);
    from.insert(from.end(), training.begin(), training.end());
  }
  if (from.empty()) from = scene.TrainingViews();
  std::ranges::sort(from);
  const size_t wanted = std::min(kMaxCandidates, from.size());
  std::set<int> candidates;
  std::set<int> shots_with;
  for (size_t i = 0; i < wanted; ++i) {
    const int view = from[(2 * i + 1) * from.size() / (2 * wanted)];
    candidates.insert(view);
    shots_with.insert(scene.views[view].moment->shot);
  }
  for (size_t i = 0; i < std::min(kMaxCandidates, shots.size()); ++i) {
    const std::vector<int> training = TrainingViewsOf(shots[i], scene);
    if (training.empty() || shots_with.contains(shots[i].number)) continue;
    candidates.insert(training[training.size() / 2]);
  }
  if (!named.empty()) {
    const int view = scene.FindView(named);
    if (!scene.views[view].held_out) candidates.insert(view);
  }
  return {candidates.begin(), candidates.end()};
}

bool PreferLongestShot(const Scene& scene,
                       const std::vector<int>& candidates,
                       KeyViewSelection* selection) {
  for (const Shot& shot : ShotsOf(scene)) {
    for (const RankedView& ranked : selection->ranking) {
      if (!ranked.set_aside.empty()) continue;
      if (scene.views[candidates[ranked.index]].moment->shot != shot.number) continue;
      const bool is_other = selection->index != ranked.index;
      selection->index = ranked.index;
      return is_other;
    }
  }
  return false;
}

ChosenKeyViews ChooseFilmKeys(const Scene& scene,
                              const std::vector<int>& candidates,
                              const std::vector<ViewFeatures>& features,
                              const std::vector<bool>& kept,
                              int count,
                              int first,
                              StageContext& context) {
  const SeenSamples none(static_cast<int>(candidates.size()), 0);
  const std::vector<Shot> shots = ShotsOf(scene);
  const auto shot_of = [&](int candidate) {
    return scene.views[candidates[candidate]].moment->shot;
  };
  std::vector<std::vector<bool>> may(shots.size());
  std::vector<ShotKeys> keys(shots.size());
  std::vector<int> firsts(shots.size(), -1), order;
  std::vector<const Shot*> with_key;
  const auto take = [&](int shot) {
    ++keys[shot].own;
    order.push_back(shot);
    with_key.push_back(&shots[shot]);
  };
  for (size_t i = 0; i < shots.size(); ++i) {
    for (size_t c = 0; c < candidates.size(); ++c) {
      may[i].push_back(kept[c] && shot_of(static_cast<int>(c)) == shots[i].number);
    }
    keys[i].possible = static_cast<int>(std::count(may[i].begin(), may[i].end(), true));
    if (first < 0 || shot_of(first) != shots[i].number) continue;
    if (!may[i][first]) ++keys[i].possible;
    firsts[i] = first;
    take(static_cast<int>(i));
  }
  const ViewImages images(scene, context.scene_folder(), kReturnSidePx, 0);
  while (static_cast<int>(order.size()) < count) {
    const int next = NextShot(shots, keys);
    if (next < 0) {
      throw InvalidArgument(
          "{} key views are asked for, but only {} of the compared frames can be one, since "
          "others are blank or torn; ask for fewer",
          count,
          order.size());
    }
    std::optional<bool>& returns = keys[next].returns;
    if (keys[next].own == 0 && !returns && !with_key.empty()) {
      returns = Returns(shots[next], with_key, images, context);
      if (*returns) continue;
    }
    take(next);
  }
  std::vector<std::vector<int>> chosen(shots.size());
  for (size_t i = 0; i < shots.size(); ++i) {
    if (keys[i].own == 0) continue;
    // Only frames of the shot count.
    std::vector<bool> asked = may[i];
    if (firsts[i] >= 0) asked[firsts[i]] = true;
    chosen[i] = ChooseKeyViews(none,
                               FindNearestDistances(features, asked, context.control()),
                               may[i],
                               keys[i].own,
                               firsts[i])
                    .views;
  }
  ChosenKeyViews result;
  std::vector<size_t> taken(shots.size(), 0);
  std::vector<bool> all = kept;
  if (first >= 0) all[first] = true;
  const NearestDistances distances = FindNearestDistances(features, all, context.control());
  for (const int shot : order) {
    result.views.push_back(chosen[shot][taken[shot]++]);
    result.error.push_back(ExpectedError(none, distances, result.views));
  }
  return result;
}

std::optional<NextFilmKey> AdviseNextFilmKey(const Scene& scene,
                                             const std::vector<int>& keys,
                                             const std::vector<double>& coverage) {
  std::set<int> with_key;
  for (const int key : keys) with_key.insert(scene.views[key].moment->shot);
  double without = 0.0, gained = 0.0;  // frames that no key frame shows, in parts
  NextFilmKey next;
  for (const Shot& shot : ShotsOf(scene)) {
    if (with_key.contains(shot.number)) continue;
    double open = 0.0;
    for (const int view : shot.views) open += 1.0 - coverage[view];
    without += open;
    const std::vector<int> training = TrainingViewsOf(shot, scene);
    if (open <= gained || training.empty() || shot.views.size() < 2) continue;
    gained = open;
    next.view = training[training.size() / 2];
  }
  if (gained == 0.0) return std::nullopt;
  const auto error = [&](double inferred) {
    return kErrorSeen +
           (kErrorInferred - kErrorSeen) * inferred / static_cast<double>(scene.views.size());
  };
  next.error_now = error(without);
  next.error_with = error(without - gained);
  return next;
}

}  // namespace color3d
