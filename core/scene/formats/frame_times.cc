#include "core/scene/formats/frame_times.h"

#include <algorithm>
#include <map>
#include <set>

#include "core/base/error.h"

namespace color3d {
namespace {

std::string FolderOf(const std::string& name) {
  const size_t slash = name.rfind('/');
  return slash == std::string::npos ? "" : name.substr(0, slash);
}

// The camera's name of each view.
std::vector<std::string> CamerasOf(const std::vector<FrameTime>& times,
                                   const std::string& file_name,
                                   const std::vector<View>& views) {
  std::vector<std::string> cameras;
  std::set<double> different;
  size_t named = 0;
  for (const FrameTime& frame : times) {
    cameras.push_back(frame.camera);
    different.insert(*frame.time);
    if (!frame.camera.empty()) ++named;
  }
  if (named == times.size()) return cameras;
  if (named > 0) {
    const auto nameless = std::find(cameras.begin(), cameras.end(), "") - cameras.begin();
    throw InvalidArgument("{}: {} has no camera, others have; give each frame one or none",
                          file_name,
                          views[nameless].name);
  }
  if (different.size() == times.size()) return cameras;
  for (size_t i = 0; i < views.size(); ++i) cameras[i] = FolderOf(views[i].name);
  return cameras;
}

}  // namespace

void SetMoments(const std::vector<FrameTime>& times,
                const std::string& file_name,
                std::vector<View>* views) {
  const auto has_time = [](const FrameTime& frame) { return frame.time.has_value(); };
  if (std::none_of(times.begin(), times.end(), has_time)) return;
  const auto without = std::find_if_not(times.begin(), times.end(), has_time);
  if (without != times.end()) {
    throw InvalidArgument("{}: {} has no time, others have; give each frame its time or none",
                          file_name,
                          (*views)[without - times.begin()].name);
  }
  const double first = *std::min_element(times.begin(), times.end(), [](auto& a, auto& b) {
                          return *a.time < *b.time;
                        })->time;
  const std::vector<std::string> cameras = CamerasOf(times, file_name, *views);
  std::map<std::string, int> shots;
  for (const std::string& camera : cameras) shots.emplace(camera, 0);
  int next = 0;
  for (auto& [camera, shot] : shots) shot = next++;
  std::map<std::pair<int, double>, size_t> taken;
  for (size_t i = 0; i < views->size(); ++i) {
    const Moment moment{*times[i].time - first, shots.at(cameras[i])};
    const auto [it, is_new] = taken.emplace(std::pair(moment.shot, moment.time_s), i);
    if (!is_new) {
      throw InvalidArgument(
          "{}: {} and {} are of one camera and one time ({}); leave one of them out, or name "
          "different cameras",
          file_name,
          (*views)[it->second].name,
          (*views)[i].name,
          *times[i].time);
    }
    (*views)[i].moment = moment;
  }
}

}  // namespace color3d
