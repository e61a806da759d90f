#include "core/splat/model/neighbors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <utility>

namespace color3d {
namespace {

struct PointCloud {
  std::vector<NeighborTree::Point> points;

  size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(size_t index, size_t axis) const { return points[index][axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;  // nanoflann computes it
  }
};

bool IsNearer(const NeighborTree::Neighbor& a, const NeighborTree::Neighbor& b) {
  return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                  : a.index < b.index;
}

// Result set for nanoflann: the k nearest points in order. Method names are required by nanoflann.
// NOLINTBEGIN(readability-identifier-naming)
class NearestInOrder {
 public:
  using DistanceType = float;

  NearestInOrder(size_t k, std::vector<NeighborTree::Neighbor>& nearest)
      : k_(k), nearest_(nearest) {}
  bool addPoint(float squared_distance, uint32_t index) {
    const NeighborTree::Neighbor here{index, squared_distance};
    if (full() && !IsNearer(here, nearest_.back())) return true;
    if (full()) nearest_.pop_back();
    nearest_.insert(std::upper_bound(nearest_.begin(), nearest_.end(), here, IsNearer), here);
    return true;
  }
  bool full() const { return nearest_.size() == k_; }
  size_t size() const { return nearest_.size(); }
  // Slightly more than the distance of the last point: the index decides between equally distant
  // points, and the search accumulates bounds with rounding errors.
  float worstDist() const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    return full() ? std::nextafter(1.00001f * nearest_.back().squared_distance, kInfinity)
                  : kInfinity;
  }

 private:
  size_t k_;
  std::vector<NeighborTree::Neighbor>& nearest_;
};
// NOLINTEND(readability-identifier-naming)

}  // namespace

struct NeighborTree::Tree {
  using Index = nanoflann::
      KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointCloud>, PointCloud, 3>;

  explicit Tree(std::vector<Point> points) : cloud{std::move(points)}, index(3, cloud) {}

  PointCloud cloud;
  Index index;
};

NeighborTree::NeighborTree(std::vector<Point> points)
    : tree_(std::make_unique<const Tree>(std::move(points))) {}

NeighborTree::~NeighborTree() = default;

void NeighborTree::Find(const Point& query, int k, std::vector<Neighbor>& neighbors) const {
  neighbors.clear();
  if (k <= 0) return;
  NearestInOrder nearest(static_cast<size_t>(k), neighbors);
  tree_->index.findNeighbors(nearest, query.data(), nanoflann::SearchParams());
}

}  // namespace color3d
