#include "core/scene/import/hold_out.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int64_t kFewestInBlock = 2;
constexpr int64_t kFewestBeside = 2;

// Times of training views.
std::set<double> TrainingTimes(const Scene& scene) {
  std::set<double> times;
  for (const int view : scene.TrainingViews()) times.insert(scene.views[view].time_s());
  return times;
}

}  // namespace

const char* NameOf(HoldOutKind how) {
  switch (how) {
    case HoldOutKind::kCamera:
      return "camera";
    case HoldOutKind::kMoment:
      return "moment";
    case HoldOutKind::kBlock:
      return "block";
    case HoldOutKind::kNot:
      break;
  }
  return "";
}

std::vector<HoldOutKind> HeldOutKinds(const Scene& scene) {
  std::vector<HoldOutKind> how(scene.views.size(), HoldOutKind::kNot);
  if (!scene.HasTimes()) return how;
  const std::vector<double> times = scene.Times();
  const std::set<double> learnt_from = TrainingTimes(scene);
  std::set<int> cameras;  // of training views
  for (const int view : scene.TrainingViews()) cameras.insert(scene.views[view].moment->shot);
  const auto is_open = [&](std::ptrdiff_t i) {
    return i >= 0 && i < std::ssize(times) && !learnt_from.contains(times[i]);
  };
  for (size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    if (!view.held_out) continue;
    if (scene.capture().is_reconstructed && !cameras.contains(view.moment->shot)) {
      how[i] = HoldOutKind::kCamera;
      continue;
    }
    const auto time = std::ranges::lower_bound(times, view.time_s()) - times.begin();
    how[i] = is_open(time - 1) || is_open(time + 1) ? HoldOutKind::kBlock : HoldOutKind::kMoment;
  }
  return how;
}

void HoldOutBlock(double share, Scene* scene) {
  if (!scene->HasTimes()) {
    throw InvalidArgument(
        "hold_out_block is {:g}, but these views have no times: it holds out a part of a film's "
        "time; leave it out",
        share);
  }
  const std::vector<double> times = scene->Times();
  const int64_t all = std::ssize(times), count = std::llround(share * static_cast<double>(all));
  if (count < kFewestInBlock) {
    throw InvalidArgument(
        "hold_out_block is {:g} of {} time steps, which is less than two of them; give {:.2g} or "
        "more (at most 0.5), or leave it out",
        share,
        all,
        static_cast<double>(kFewestInBlock) / static_cast<double>(all));
  }
  const int64_t first = (all - count) / 2;
  const double begin_s = times[first], end_s = times[first + count - 1];
  for (View& view : scene->views) {
    view.held_out |= view.time_s() >= begin_s && view.time_s() <= end_s;
  }
  const std::set<double> left = TrainingTimes(*scene);
  const auto before = std::distance(left.begin(), left.lower_bound(begin_s));
  const auto behind = std::distance(left.upper_bound(end_s), left.end());
  if (before >= kFewestBeside && behind >= kFewestBeside) return;
  throw InvalidArgument(
      "hold_out_block is {:g}: of {} time steps, {} are left for training before the block and {} "
      "after it, and two are needed on each side; give less, or leave it out",
      share,
      all,
      before,
      behind);
}

}  // namespace color3d
