#include "core/scene/frame_times.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr double kSameTime = 1e-6;  // share of all time

// Relative to images/.
std::string Folder(std::string file) {
  if (file.starts_with("images/")) file.erase(0, 7);
  const size_t slash = file.rfind('/');
  return slash == std::string::npos ? "" : file.substr(0, slash);
}

// True when all have it, false when none has.
template <typename Has>
bool AllOrNone(const std::vector<FrameTime>& frames, const char* what, const Has& has) {
  const bool first = !frames.empty() && has(frames[0]);
  for (const FrameTime& frame : frames) {
    if (has(frame) == first) continue;
    const FrameTime& without = first ? frame : frames[0];
    const FrameTime& with = first ? frames[0] : frame;
    throw InvalidArgument("{} ({}) has no {}, but {} has one; give it to every frame, or to none",
                          without.place,
                          without.file,
                          what,
                          with.place);
  }
  return first;
}

// From the earliest on, with those that only rounding keeps apart made equal.
std::vector<double> ShiftedTimes(const std::vector<FrameTime>& frames) {
  std::vector<size_t> order(frames.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return *frames[a].time < *frames[b].time;
  });
  const double begin = *frames[order.front()].time;
  const double span = *frames[order.back()].time - begin;
  if (!std::isfinite(span)) {
    throw InvalidArgument("{} and {} are too far apart in time ({:g} and {:g})",
                          frames[order.front()].place,
                          frames[order.back()].place,
                          begin,
                          *frames[order.back()].time);
  }
  std::vector<double> times(frames.size());
  double last = 0.0;
  for (const size_t i : order) {
    const double time = *frames[i].time - begin;
    if (time - last > kSameTime * span) last = time;
    times[i] = last;
  }
  return times;
}

bool SomeShareATime(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  return std::adjacent_find(times.begin(), times.end()) != times.end();
}

}  // namespace

FrameMoments MomentsOf(const std::vector<FrameTime>& frames) {
  FrameMoments result;
  result.moments.resize(frames.size());
  if (!AllOrNone(frames, "time", [](const FrameTime& f) { return f.time.has_value(); })) {
    return result;
  }
  const bool named =
      AllOrNone(frames, "camera", [](const FrameTime& f) { return !f.camera.empty(); });
  const std::vector<double> times = ShiftedTimes(frames);
  if (*std::max_element(times.begin(), times.end()) == 0.0) {
    result.note = fmt::format("all {} frames were taken at one time: a scene that stands still",
                              frames.size());
    return result;
  }
  const bool by_folder = !named && SomeShareATime(times);
  std::map<std::string, int> shots;
  std::vector<std::string> camera(frames.size());
  for (size_t i = 0; i < frames.size(); ++i) {
    camera[i] = named ? frames[i].camera : by_folder ? Folder(frames[i].file) : "";
    shots[camera[i]] = 0;
  }
  for (auto& [name, shot] : shots) {
    shot = static_cast<int>(result.cameras.size());
    result.cameras.push_back(name);
  }
  std::map<std::pair<int, double>, size_t> taken;
  for (size_t i = 0; i < frames.size(); ++i) {
    result.moments[i] = Moment{times[i], shots[camera[i]]};
    const auto [found, fresh] = taken.emplace(std::pair(shots[camera[i]], times[i]), i);
    if (fresh) continue;
    const FrameTime& other = frames[found->second];
    throw InvalidArgument(
        "{} ({}) and {} ({}) are of one camera{} and one time ({:g}); remove one of them{}",
        other.place,
        other.file,
        frames[i].place,
        frames[i].file,
        named ? " (" + camera[i] + ")" : "",
        *frames[i].time,
        named ? "" : ", or give every frame the name of its \"camera\", or each camera a folder");
  }
  return result;
}

}  // namespace color3d
