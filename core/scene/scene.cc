#include "core/scene/scene.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "core/base/error.h"

namespace color3d {
namespace {

std::string_view Stem(std::string_view name) {
  const size_t slash = name.rfind('/');
  const size_t dot = name.rfind('.');
  if (dot == std::string_view::npos || dot == 0) return name;
  if (slash != std::string_view::npos && dot <= slash + 1) return name;
  return name.substr(0, dot);
}

std::vector<int> SelectViews(const std::vector<View>& views, bool held_out) {
  std::vector<int> indices;
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].held_out == held_out) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

// Returns true unless all views have the same position and direction.
bool HasPoses(const std::vector<View>& views) {
  return std::ranges::any_of(views, [&](const View& view) {
    const Pose &one = view.cam_from_world, &first = views.front().cam_from_world;
    return one.translation != first.translation || one.rotation.coeffs() != first.rotation.coeffs();
  });
}

}  // namespace

std::vector<int> Scene::TrainingViews() const { return SelectViews(views, /*held_out=*/false); }

std::vector<int> Scene::HeldOutViews() const { return SelectViews(views, /*held_out=*/true); }

int Scene::FindView(std::string_view name) const {
  int by_stem = -1;
  int stems = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].name == name) return static_cast<int>(i);
    if (Stem(views[i].name) == Stem(name)) {
      by_stem = static_cast<int>(i);
      ++stems;
    }
  }
  if (stems == 1) return by_stem;
  std::string known;
  for (size_t i = 0; i < std::min<size_t>(views.size(), 3); ++i) {
    known += (i == 0 ? "" : ", ") + views[i].name;
  }
  throw Error(ErrorCode::kNotFound,
              "the scene has no view named " + std::string(name) +
                  (views.empty() ? "; it has no views"
                                 : "; it has " + known + (views.size() > 3 ? ", ..." : "")));
}

bool Scene::HasTimes() const {
  return !views.empty() &&
         std::ranges::all_of(views, [](const View& view) { return view.moment.has_value(); });
}

CaptureKind Scene::kind() const {
  if (are_pictures && !HasPoses(views)) return CaptureKind::kPictures;
  if (!HasTimes()) return CaptureKind::kStatic;
  if (relief) return CaptureKind::kRelief;
  return HasPoses(views) ? CaptureKind::kDynamic : CaptureKind::kFilm;
}

std::vector<int> Scene::ViewsInOrderOfTime() const {
  std::vector<int> order(views.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int i) { return views[i].time_s(); });
  return order;
}

std::vector<double> Scene::Times() const {
  std::set<double> times;
  for (const View& view : views) times.insert(view.time_s());
  return {times.begin(), times.end()};
}

std::vector<int> Scene::FramesInShot(int view) const {
  std::vector<int> frames = ViewsInOrderOfTime();
  std::erase_if(frames, [&](int i) { return views[i].moment->shot != views[view].moment->shot; });
  return frames;
}

double Scene::Extent() const {
  const std::vector<int> training = TrainingViews();
  if (training.empty()) return 1.0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i : training) mean += views[i].cam_from_world.Center();
  mean /= static_cast<double>(training.size());
  double radius = 0.0;
  for (int i : training) {
    radius = std::max(radius, (views[i].cam_from_world.Center() - mean).norm());
  }
  return radius > 0.0 ? 1.1 * radius : 1.0;
}

}  // namespace color3d
