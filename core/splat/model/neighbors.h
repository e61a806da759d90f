// Nearest neighbours in 3D by a k-d tree. Immutable after construction, so safe to share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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

  // The min(k, size) nearest points, nearest first; ties by index of the tree's order.
  void Find(const Point& query, int k, std::vector<Neighbor>& neighbors) const;

 private:
  void Build(uint32_t begin, uint32_t end);
  void Search(uint32_t begin,
              uint32_t end,
              const Point& query,
              size_t k,
              std::vector<Neighbor>& heap) const;

  std::vector<Point> points_;    // as given
  std::vector<uint32_t> order_;  // implicit balanced tree: the median of a range is its root
  std::vector<uint8_t> axis_;    // split axis of the root of a range, at its median
};

}  // namespace color3d
