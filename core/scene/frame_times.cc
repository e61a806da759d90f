#include "core/scene/frame_times.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>

#include "core/base/error.h"
#include "core/base/median.h"

namespace color3d {
namespace {

constexpr double kSameTime = 1e-6;     // fraction of the whole range
constexpr double kSameTick = 0.25;     // fraction of a step of the cameras' clock
constexpr double kNotedOffset = 0.05;  // likewise: a larger offset is no rounding error

// Relative to images/.
std::string Folder(std::string file) {
  if (file.starts_with("images/")) file.erase(0, 7);
  const size_t slash = file.rfind('/');
  return slash == std::string::npos ? "" : file.substr(0, slash);
}

// Returns true if all frames have it, false if none has.
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

// Shifts times so that the earliest is 0, and makes times equal that differ by rounding only.
std::vector<double> ShiftedTimes(const std::vector<FrameTime>& frames) {
  std::vector<size_t> order(frames.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return *frames[i].time; });
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

bool HasEqualTimes(std::vector<double> times) {
  std::ranges::sort(times);
  return std::ranges::adjacent_find(times) != times.end();
}

// Frames of each camera, in order of time.
using FramesByCamera = std::map<std::string, std::vector<size_t>>;

FramesByCamera ByCamera(const std::vector<std::string>& camera, const std::vector<double>& times) {
  FramesByCamera frames;
  for (size_t i = 0; i < times.size(); ++i) frames[camera[i]].push_back(i);
  for (auto& [name, own] : frames) {
    std::ranges::stable_sort(own, {}, [&](size_t i) { return times[i]; });
  }
  return frames;
}

double MedianStep(const FramesByCamera& cameras, const std::vector<double>& times) {
  std::vector<double> steps;
  for (const auto& [name, own] : cameras) {
    for (size_t i = 1; i < own.size(); ++i) steps.push_back(times[own[i]] - times[own[i - 1]]);
  }
  return steps.empty() ? 0.0 : Median(std::move(steps));
}

// Returns the tick of each frame if all cameras follow one clock to a quarter of a step; else
// empty. Steps are counted one by one, since rounded times drift against any constant step.
std::vector<int64_t> CountTicks(const FramesByCamera& cameras, const std::vector<double>& times) {
  constexpr double kMaxSteps = 1e6;  // missing between two frames
  const double step = MedianStep(cameras, times);
  if (!(step > 0.0)) return {};
  std::vector<int64_t> ticks(times.size());
  int64_t most = 0;
  double seconds = 0.0;  // that the most ticks of one camera take
  for (const auto& [name, own] : cameras) {
    for (size_t i = 1; i < own.size(); ++i) {
      const double steps = (times[own[i]] - times[own[i - 1]]) / step;
      if (steps < 0.5 || steps > kMaxSteps) return {};
      ticks[own[i]] = ticks[own[i - 1]] + std::llround(steps);
    }
    if (ticks[own.back()] <= most) continue;
    most = ticks[own.back()];
    seconds = times[own.back()] - times[own.front()];
  }
  if (most == 0) return {};
  const double tick_s = seconds / static_cast<double>(most);
  for (const auto& [name, own] : cameras) {
    const int64_t first = std::llround(times[own.front()] / tick_s);
    for (const size_t i : own) {
      ticks[i] += first;
      if (std::abs(times[i] - static_cast<double>(ticks[i]) * tick_s) > kSameTick * tick_s) {
        return {};
      }
    }
  }
  return ticks;
}

// Sets the times of each tick of a rig's clock, if there is one, to the earliest of them; adds a
// note if they differ by more than the rounding of containers.
void ShareMoments(const std::vector<std::string>& camera,
                  std::vector<double>* times,
                  FrameMoments* result) {
  const FramesByCamera cameras = ByCamera(camera, *times);
  if (cameras.size() < 2) return;
  const std::vector<int64_t> ticks = CountTicks(cameras, *times);
  result->one_clock = !ticks.empty();
  if (ticks.empty()) return;
  std::map<int64_t, double> earliest;
  for (size_t i = 0; i < ticks.size(); ++i) {
    double& time = earliest.try_emplace(ticks[i], (*times)[i]).first->second;
    time = std::min(time, (*times)[i]);
  }
  const double rounding = kNotedOffset * MedianStep(cameras, *times);
  double moved = 0.0;
  for (size_t i = 0; i < ticks.size(); ++i) {
    const double time = earliest.at(ticks[i]);
    moved = std::max(moved, (*times)[i] - time);
    (*times)[i] = time;
  }
  if (moved <= rounding) return;
  result->note = fmt::format(
      "the cameras' clocks differ by up to {:.3g} s: frames closer than that count as "
      "simultaneous",
      moved);
}

}  // namespace

FrameMoments AssignMoments(const std::vector<FrameTime>& frames) {
  FrameMoments result;
  result.moments.resize(frames.size());
  if (!AllOrNone(frames, "time", [](const FrameTime& f) { return f.time.has_value(); })) {
    return result;
  }
  const bool named =
      AllOrNone(frames, "camera", [](const FrameTime& f) { return !f.camera.empty(); });
  std::vector<double> times = ShiftedTimes(frames);
  if (*std::ranges::max_element(times) == 0.0) {
    result.note =
        fmt::format("all {} frames were taken at one time: the scene is static", frames.size());
    return result;
  }
  const bool by_folder = !named && HasEqualTimes(times);
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
  ShareMoments(camera, &times, &result);
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
        named
            ? ""
            : ", or give each camera a folder (in transforms.json also: each frame a \"camera\")");
  }
  return result;
}

void AddMoments(FrameMoments moments,
                Scene* scene,
                std::vector<std::string>* warnings,
                std::vector<std::string>* cameras) {
  for (size_t i = 0; i < scene->views.size(); ++i) scene->views[i].moment = moments.moments[i];
  if (!moments.note.empty() && warnings != nullptr) warnings->push_back(std::move(moments.note));
  if (cameras != nullptr) *cameras = std::move(moments.cameras);
}

}  // namespace color3d
