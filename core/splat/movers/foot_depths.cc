#include "core/splat/movers/foot_depths.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/base/median.h"

namespace color3d {
namespace {

constexpr int kFramesOnEitherSide = 8;  // for the median of an object's depth

// A moving region, or several that form one object.
struct MovingObject {
  int left = 0, right = 0;  // columns, both included
  int foot = 0;             // its lowest row
  double depth = 0.0;       // there
};

struct MovingObjects {
  std::vector<int> of_pixel;  // -1: nothing moves
  std::vector<MovingObject> list;
};

// Connected components of the moving pixels.
MovingObjects RegionsOf(const SurveyedView& view) {
  const Image& moving = view.moving;
  const double usual = MedianDepth(view);
  MovingObjects objects;
  objects.of_pixel.assign(moving.data.size(), -1);
  std::vector<int> region;
  for (int start = 0; start < static_cast<int>(moving.data.size()); ++start) {
    if (moving.data[start] == 0.0f || objects.of_pixel[start] >= 0) continue;
    const auto number = static_cast<int>(objects.list.size());
    MovingObject object{moving.width, -1, -1};
    int foot_pixel = start;
    const auto reach = [&](int x, int y) {
      if (x < 0 || y < 0 || x >= moving.width || y >= moving.height) return;
      const int pixel = y * moving.width + x;
      if (moving.data[pixel] == 0.0f || objects.of_pixel[pixel] >= 0) return;
      objects.of_pixel[pixel] = number;
      region.push_back(pixel);
    };
    region.clear();
    reach(start % moving.width, start / moving.width);
    for (size_t k = 0; k < region.size(); ++k) {
      const int x = region[k] % moving.width, y = region[k] / moving.width;
      object.left = std::min(object.left, x);
      object.right = std::max(object.right, x);
      if (y > object.foot) {
        object.foot = y;
        foot_pixel = region[k];
      }
      reach(x - 1, y);
      reach(x + 1, y);
      reach(x, y - 1);
      reach(x, y + 1);
    }
    const float at_foot = view.depth.data[foot_pixel];
    object.depth = at_foot > 0.0f ? at_foot : usual;
    objects.list.push_back(object);
  }
  return objects;
}

int SharedColumns(const MovingObject& a, const MovingObject& b) {
  return std::max(0, std::min(a.right, b.right) - std::max(a.left, b.left) + 1);
}

int Columns(const MovingObject& object) { return object.right - object.left + 1; }

// Torn-off limbs, and the shadow below, belong to the object above which they hang.
void MergeStackedRegions(MovingObjects* objects) {
  std::vector<int> joined(objects->list.size());
  std::vector<int> order(objects->list.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return objects->list[a].foot > objects->list[b].foot;
  });
  std::vector<MovingObject> list;
  for (const int region : order) {  // the lowest first: it has the foot
    const MovingObject& object = objects->list[region];
    const auto below = std::find_if(list.begin(), list.end(), [&](const MovingObject& other) {
      return 2 * SharedColumns(object, other) >= Columns(object);
    });
    joined[region] = static_cast<int>(below - list.begin());
    if (below == list.end()) {
      list.push_back(object);
      continue;
    }
    below->left = std::min(below->left, object.left);
    below->right = std::max(below->right, object.right);
  }
  for (int& number : objects->of_pixel) {
    if (number >= 0) number = joined[number];
  }
  objects->list = std::move(list);
}

// Depth of the object at the same position in `frame`; 0 without one.
double OverlappingDepth(const MovingObject& object, const MovingObjects& frame) {
  double depth = 0.0;
  int most = 0;
  for (const MovingObject& other : frame.list) {
    const int shared = SharedColumns(object, other);
    if (shared <= most || 2 * shared < std::min(Columns(object), Columns(other))) continue;
    most = shared;
    depth = other.depth;
  }
  return depth;
}

std::vector<size_t> OrderByTime(const std::vector<SurveyedView>& views) {
  std::vector<size_t> order(views.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return views[a].posed.time_s < views[b].posed.time_s;
  });
  return order;
}

void SmoothDepthsOverTime(const std::vector<size_t>& order, std::vector<MovingObjects>* frames) {
  const std::vector<MovingObjects> before = *frames;
  const auto count = static_cast<int>(order.size());
  for (int i = 0; i < count; ++i) {
    for (MovingObject& object : (*frames)[order[i]].list) {
      std::vector<double> depths{object.depth};
      for (int k = std::max(0, i - kFramesOnEitherSide);
           k <= std::min(count - 1, i + kFramesOnEitherSide);
           ++k) {
        const double depth = k == i ? 0.0 : OverlappingDepth(object, before[order[k]]);
        if (depth > 0.0) depths.push_back(depth);
      }
      object.depth = Median(std::move(depths));
    }
  }
}

bool HaveOnePose(const std::vector<SurveyedView>& views) {
  const Pose& first = views.front().posed.cam_from_world;
  return std::all_of(views.begin(), views.end(), [&](const SurveyedView& view) {
    const Pose& pose = view.posed.cam_from_world;
    return pose.translation == first.translation &&
           pose.rotation.coeffs() == first.rotation.coeffs();
  });
}

}  // namespace

double MedianDepth(const SurveyedView& view) {
  std::vector<float> depths;
  for (const float d : view.depth.data) {
    if (d > 0.0f) depths.push_back(d);
  }
  if (depths.empty()) return 0.0;
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  return depths[depths.size() / 2];
}

std::vector<Image> FootDepths(const std::vector<SurveyedView>& views, ThreadPool& pool) {
  if (views.empty()) return {};
  const auto count = static_cast<int64_t>(views.size());
  const bool have_one_pose = HaveOnePose(views);
  std::vector<MovingObjects> frames(views.size());
  pool.ForEach(count, [&](int64_t i, int) {
    frames[i] = RegionsOf(views[i]);
    if (have_one_pose) MergeStackedRegions(&frames[i]);
  });
  if (have_one_pose) SmoothDepthsOverTime(OrderByTime(views), &frames);
  std::vector<Image> depths(views.size());
  pool.ForEach(count, [&](int64_t i, int) {
    Image& depth = depths[i] = Image(views[i].moving.width, views[i].moving.height, 1);
    for (size_t p = 0; p < depth.data.size(); ++p) {
      const int number = frames[i].of_pixel[p];
      if (number >= 0) depth.data[p] = static_cast<float>(frames[i].list[number].depth);
    }
  });
  return depths;
}

}  // namespace color3d
