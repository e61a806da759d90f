#include "core/splat/model/neighbors.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace color3d {
namespace {

bool Nearer(const NeighborTree::Neighbor& a, const NeighborTree::Neighbor& b) {
  return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                  : a.index < b.index;
}

}  // namespace

NeighborTree::NeighborTree(std::vector<Point> points)
    : points_(std::move(points)), order_(points_.size()), axis_(points_.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  Build(0, static_cast<uint32_t>(points_.size()));
}

void NeighborTree::Build(uint32_t begin, uint32_t end) {
  if (end - begin < 2) return;
  Point low = points_[order_[begin]], high = low;
  for (uint32_t i = begin; i < end; ++i) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], points_[order_[i]][k]);
      high[k] = std::max(high[k], points_[order_[i]][k]);
    }
  }
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  const uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(
      order_.begin() + begin,
      order_.begin() + middle,
      order_.begin() + end,
      [&](uint32_t a, uint32_t b) {
        return points_[a][axis] != points_[b][axis] ? points_[a][axis] < points_[b][axis] : a < b;
      });
  axis_[middle] = static_cast<uint8_t>(axis);
  Build(begin, middle);
  Build(middle + 1, end);
}

void NeighborTree::Search(
    uint32_t begin, uint32_t end, const Point& query, size_t k, std::vector<Neighbor>& heap) const {
  if (begin >= end) return;
  const uint32_t middle = begin + (end - begin) / 2;
  const Point& p = points_[order_[middle]];
  float distance = 0.0f;
  for (int a = 0; a < 3; ++a) distance += (p[a] - query[a]) * (p[a] - query[a]);
  const Neighbor here{order_[middle], distance};
  if (heap.size() < k) {
    heap.push_back(here);
    std::push_heap(heap.begin(), heap.end(), Nearer);
  } else if (Nearer(here, heap.front())) {
    std::pop_heap(heap.begin(), heap.end(), Nearer);
    heap.back() = here;
    std::push_heap(heap.begin(), heap.end(), Nearer);
  }
  const float offset = query[axis_[middle]] - p[axis_[middle]];
  const bool left_first = offset < 0.0f;
  if (left_first) {
    Search(begin, middle, query, k, heap);
  } else {
    Search(middle + 1, end, query, k, heap);
  }
  if (heap.size() < k || offset * offset <= heap.front().squared_distance) {
    if (left_first) {
      Search(middle + 1, end, query, k, heap);
    } else {
      Search(begin, middle, query, k, heap);
    }
  }
}

void NeighborTree::Find(const Point& query, int k, std::vector<Neighbor>& neighbors) const {
  neighbors.clear();
  if (k <= 0) return;
  Search(0, static_cast<uint32_t>(order_.size()), query, static_cast<size_t>(k), neighbors);
  std::sort_heap(neighbors.begin(), neighbors.end(), Nearer);
}

}  // namespace color3d
