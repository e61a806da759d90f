#include "core/keyview/expected_error.h"

#include <algorithm>
#include <limits>

#include "core/base/error.h"
#include "core/base/median.h"

namespace color3d {
namespace {

constexpr double kMaxTable = 5e7;  // maximum number of entries of SeenSamples
// Error of a cell identical to one of a key view. A cell at the median distance has kErrorInferred.
constexpr double kErrorAlike = 4.0;

bool Contains(const std::vector<int>& keys, int view) {
  return std::find(keys.begin(), keys.end(), view) != keys.end();
}

// Expected error of a set of key views.
class Expectation {
 public:
  Expectation(const SeenSamples& seen, const NearestDistances& distances)
      : seen_(seen), distances_(distances), median_(MedianDistance(distances)) {}

  // Mean over all views.
  double Of(const std::vector<int>& keys) const {
    const int views = seen_.views();
    std::vector<double> strangeness(views, 0.0);
    for (size_t q = 0; q < distances_.owner.size(); ++q) {
      float least = std::numeric_limits<float>::max();
      for (const int key : keys) {
        if (!distances_.from[key].empty()) least = std::min(least, distances_.from[key][q]);
      }
      strangeness[distances_.owner[q]] += distances_.weight[q] * least;
    }
    double sum = 0.0;
    for (int view = 0; view < views; ++view) {
      const double inferred =
          median_ > 0.0 && strangeness[view] < 1e6
              ? kErrorAlike + (kErrorInferred - kErrorAlike) * strangeness[view] / median_
              : kErrorInferred;
      const double shown = SeenShare(keys, view);
      sum += shown * kErrorSeen + (1.0 - shown) * std::min(inferred, kErrorGuessed);
    }
    return sum / views;
  }

 private:
  // Typical distance of a cell to the nearest one of another view.
  static double MedianDistance(const NearestDistances& distances) {
    std::vector<double> values;
    for (size_t i = 0; i < distances.from.size(); ++i) {
      for (size_t q = 0; q < distances.from[i].size(); ++q) {
        if (distances.owner[q] != static_cast<int>(i)) values.push_back(distances.from[i][q]);
      }
    }
    return values.empty() ? 0.0 : Median(values);
  }

  double SeenShare(const std::vector<int>& keys, int view) const {
    if (Contains(keys, view)) return 1.0;
    if (seen_.samples() == 0) return 0.0;
    int shown = 0;
    for (int s = 0; s < seen_.samples(); ++s) {
      shown += std::any_of(
          keys.begin(), keys.end(), [&](int key) { return seen_.IsSeen(key, view, s); });
    }
    return static_cast<double>(shown) / seen_.samples();
  }

  const SeenSamples& seen_;
  const NearestDistances& distances_;
  double median_;
};

// Best view in place of keys[place]. `keys` may grow by one.
void PutBest(const Expectation& expectation,
             const std::vector<bool>& allowed,
             size_t place,
             std::vector<int>* keys) {
  std::vector<int> best = *keys;
  double least = place < keys->size() ? expectation.Of(*keys) : std::numeric_limits<double>::max();
  for (size_t view = 0; view < allowed.size(); ++view) {
    if (!allowed[view] || Contains(*keys, static_cast<int>(view))) continue;
    std::vector<int> with = *keys;
    if (place < with.size()) {
      with[place] = static_cast<int>(view);
    } else {
      with.push_back(static_cast<int>(view));
    }
    const double error = expectation.Of(with);
    if (error < least) {
      least = error;
      best = std::move(with);
    }
  }
  *keys = std::move(best);
}

}  // namespace

int SeenSamples::SamplesFor(int views, int wanted) {
  const double affordable = kMaxTable / (static_cast<double>(views) * views);
  return std::clamp(static_cast<int>(affordable), 4, wanted);
}

ChosenKeyViews ChooseKeyViews(const SeenSamples& seen,
                              const NearestDistances& distances,
                              const std::vector<bool>& allowed,
                              int count,
                              int first) {
  const auto possible =
      std::count(allowed.begin(), allowed.end(), true) + (first >= 0 && !allowed.at(first) ? 1 : 0);
  if (count > possible) {
    throw InvalidArgument(
        "{} key views were requested, but only {} training views are fit to be one; request fewer",
        count,
        possible);
  }
  const Expectation expectation(seen, distances);
  std::vector<int> keys;
  if (first >= 0) keys.push_back(first);
  while (static_cast<int>(keys.size()) < count) {
    PutBest(expectation, allowed, keys.size(), &keys);
  }
  // Exchanges take too long for large scenes.
  constexpr int kMaxForExchange = 100;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds && seen.views() <= kMaxForExchange && count > 1; ++round) {
    const std::vector<int> before = keys;
    for (size_t place = first >= 0 ? 1 : 0; place < keys.size(); ++place) {
      PutBest(expectation, allowed, place, &keys);
    }
    if (keys == before) break;
  }
  ChosenKeyViews chosen;
  std::vector<int> so_far;
  for (const int key : keys) {
    so_far.push_back(key);
    chosen.error.push_back(expectation.Of(so_far));
  }
  chosen.views = std::move(keys);
  return chosen;
}

double ExpectedError(const SeenSamples& seen,
                     const NearestDistances& distances,
                     const std::vector<int>& keys) {
  return Expectation(seen, distances).Of(keys);
}

std::optional<NextKeyViewAdvice> NextKeyView(const SeenSamples& seen,
                                             const NearestDistances& distances,
                                             const std::vector<int>& keys) {
  const Expectation expectation(seen, distances);
  NextKeyViewAdvice advice;
  advice.error_now = advice.error_with = expectation.Of(keys);
  std::vector<int> with = keys;
  with.push_back(0);
  for (int view = 0; view < seen.views(); ++view) {
    if (Contains(keys, view)) continue;
    with.back() = view;
    const double error = expectation.Of(with);
    if (error >= advice.error_with) continue;
    advice.view = view;
    advice.error_with = error;
  }
  constexpr double kWorthTelling = 0.02;
  if (advice.error_now - advice.error_with < kWorthTelling) return std::nullopt;
  return advice;
}

}  // namespace color3d
