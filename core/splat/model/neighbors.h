// Nearest neighbours in 3D by a k-d tree (nanoflann). Immutable after construction, so safe to
// share.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace color3d {

class NeighborTree {
 public:
  using Point = std::array<float, 3>;
  struct Neighbor {
    uint32_t index = 0;
    float squared_distance = 0.0f;
  };

  explicit NeighborTree(std::vector<Point> points);
  ~NeighborTree();

  // The min(k, size) nearest points, nearest first, ties by index.
  void Find(const Point& query, int k, std::vector<Neighbor>& neighbors) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace color3d
