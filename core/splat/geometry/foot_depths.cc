#include "core/splat/geometry/foot_depths.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/base/median.h"

namespace color3d {
namespace {

constexpr int kFramesBeside = 8;  // before and behind, that tell of a thing's depth

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
  MovingObjects things;
  things.of_pixel.assign(moving.data.size(), -1);
  std::vector<int> region;
  for (int start = 0; start < static_cast<int>(moving.data.size()); ++start) {
    if (moving.data[start] == 0.0f || things.of_pixel[start] >= 0) continue;
    const auto number = static_cast<int>(things.list.size());
    MovingObject thing{moving.width, -1, -1};
    int foot_pixel = start;
    const auto reach = [&](int x, int y) {
      if (x < 0 || y < 0 || x >= moving.width || y >= moving.height) return;
      const int pixel = y * moving.width + x;
      if (moving.data[pixel] == 0.0f || things.of_pixel[pixel] >= 0) return;
      things.of_pixel[pixel] = number;
      region.push_back(pixel);
    };
    region.clear();
    reach(start % moving.width, start / moving.width);
    for (size_t k = 0; k < region.size(); ++k) {
      const int x = region[k] % moving.width, y = region[k] / moving.width;
      thing.left = std::min(thing.left, x);
      thing.right = std::max(thing.right, x);
      if (y > thing.foot) {
        thing.foot = y;
        foot_pixel = region[k];
      }
      reach(x - 1, y);
      reach(x + 1, y);
      reach(x, y - 1);
      reach(x, y + 1);
    }
    const float at_foot = view.depth.data[foot_pixel];
    thing.depth = at_foot > 0.0f ? at_foot : usual;
    things.list.push_back(thing);
  }
  return things;
}

int SharedColumns(const MovingObject& a, const MovingObject& b) {
  return std::max(0, std::min(a.right, b.right) - std::max(a.left, b.left) + 1);
}

int Columns(const MovingObject& thing) { return thing.right - thing.left + 1; }

// Torn-off limbs, and the shadow below, belong to the object above which they hang.
void MergeStackedRegions(MovingObjects* things) {
  std::vector<int> joined(things->list.size());
  std::vector<int> order(things->list.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return things->list[a].foot > things->list[b].foot;
  });
  std::vector<MovingObject> list;
  for (const int region : order) {  // the lowest first: theirs is the foot
    const MovingObject& thing = things->list[region];
    const auto below = std::find_if(list.begin(), list.end(), [&](const MovingObject& other) {
      return 2 * SharedColumns(thing, other) >= Columns(thing);
    });
    joined[region] = static_cast<int>(below - list.begin());
    if (below == list.end()) {
      list.push_back(thing);
      continue;
    }
    below->left = std::min(below->left, thing.left);
    below->right = std::max(below->right, thing.right);
  }
  for (int& number : things->of_pixel) {
    if (number >= 0) number = joined[number];
  }
  things->list = std::move(list);
}

// Depth of the object at the same position in `frame`; 0 without one.
double OverlappingDepth(const MovingObject& thing, const MovingObjects& frame) {
  double depth = 0.0;
  int most = 0;
  for (const MovingObject& other : frame.list) {
    const int shared = SharedColumns(thing, other);
    if (shared <= most || 2 * shared < std::min(Columns(thing), Columns(other))) continue;
    most = shared;
    depth = other.depth;
  }
  return depth;
}

std::vector<size_t> InOrderOfTime(const std::vector<SurveyedView>& views) {
  std::vector<size_t> order(views.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return views[a].posed.time_s < views[b].posed.time_s;
  });
  return order;
}

void SteadyDepths(const std::vector<size_t>& order, std::vector<MovingObjects>* frames) {
  const std::vector<MovingObjects> before = *frames;
  const auto count = static_cast<int>(order.size());
  for (int i = 0; i < count; ++i) {
    for (MovingObject& thing : (*frames)[order[i]].list) {
      std::vector<double> depths{thing.depth};
      for (int k = std::max(0, i - kFramesBeside); k <= std::min(count - 1, i + kFramesBeside);
           ++k) {
        const double depth = k == i ? 0.0 : OverlappingDepth(thing, before[order[k]]);
        if (depth > 0.0) depths.push_back(depth);
      }
      thing.depth = Median(std::move(depths));
    }
  }
}

bool AreOfOnePose(const std::vector<SurveyedView>& views) {
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
  const bool are_of_one_pose = AreOfOnePose(views);
  std::vector<MovingObjects> frames(views.size());
  pool.ForEach(count, [&](int64_t i, int) {
    frames[i] = RegionsOf(views[i]);
    if (are_of_one_pose) MergeStackedRegions(&frames[i]);
  });
  if (are_of_one_pose) SteadyDepths(InOrderOfTime(views), &frames);
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
