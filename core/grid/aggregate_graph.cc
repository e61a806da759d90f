#include "core/grid/aggregate_graph.h"

#include <algorithm>
#include <array>

namespace color3d {
namespace {

// A cluster grows along edges of at least this share of a node's strongest, up to kMaxNodes.
constexpr float kStrongShare = 0.8f;
constexpr int32_t kMaxNodes = 4;
// A node whose strongest edge holds this share of its diagonal may join a full cluster: one step of
// the smoother settles it, and stars of many leaves would not get any smaller otherwise.
constexpr float kDominantShare = 0.5f;
constexpr int64_t kGridRangeNodes = 1 << 18;
constexpr int64_t kGraphRangeNodes = 1 << 17;

// Both kinds of graph behind one interface: Visit(i, visit) calls visit(j, weight) for every
// neighbour with a weight > 0, in a fixed order.
struct GridView {
  const GridSystem& s;
  int64_t NodeCount() const { return s.PixelCount(); }
  float Data(int64_t i) const { return s.data[i]; }
  template <typename VisitEdge>
  void Visit(int64_t i, VisitEdge&& visit) const {
    const int64_t w = s.width;
    const std::array<float, 8> weights{s.down_right[i - w - 1],
                                       s.down[i - w],
                                       s.down_left[i - w + 1],
                                       s.right[i - 1],
                                       s.right[i],
                                       s.down_left[i],
                                       s.down[i],
                                       s.down_right[i]};
    const std::array<int64_t, 8> offsets{-w - 1, -w, -w + 1, -1, 1, w - 1, w, w + 1};
    for (size_t k = 0; k < 8; ++k) {
      if (weights[k] > 0.0f) visit(i + offsets[k], weights[k]);
    }
  }
};

struct GraphView {
  const AggregateGraph& g;
  int64_t NodeCount() const { return g.NodeCount(); }
  float Data(int64_t i) const { return g.data[i]; }
  template <typename VisitEdge>
  void Visit(int64_t i, VisitEdge&& visit) const {
    for (int64_t k = g.row_begin[i]; k < g.row_begin[i + 1]; ++k) visit(g.neighbor[k], g.weight[k]);
  }
};

// Clusters of the nodes [begin, end), numbered from 0; `of_node` is -1 there at first.
template <typename View>
class RangeClusterer {
 public:
  RangeClusterer(const View& view, int64_t begin, int64_t end, std::vector<int32_t>& of_node)
      : view_(view), begin_(begin), end_(end), of_node_(of_node) {}

  int64_t Run() {
    for (int64_t i = begin_; i < end_; ++i) Place(i);
    // Nodes without an edge join any cluster.
    if (sizes_.empty()) sizes_.push_back(0);
    for (int64_t i = begin_; i < end_; ++i) {
      if (of_node_[i] < 0) of_node_[i] = 0;
    }
    return static_cast<int64_t>(sizes_.size());
  }

 private:
  int32_t SizeOf(int64_t i) const { return of_node_[i] < 0 ? 1 : sizes_[of_node_[i]]; }

  void Place(int64_t i) {
    float strongest = 0.0f, diagonal = view_.Data(i);
    int64_t strongest_node = -1;
    view_.Visit(i, [&](int64_t j, float w) {
      diagonal += w;
      if (w <= strongest) return;
      strongest = w;
      strongest_node = j;
    });
    if (strongest_node < 0) return;
    const int32_t own = SizeOf(i);
    if (own < kMaxNodes) {
      const int64_t partner = SmallestStrongNeighbor(i, kStrongShare * strongest, own);
      if (partner >= 0) return Join(i, partner);
    }
    if (of_node_[i] >= 0) return;
    if (strongest >= kDominantShare * diagonal && InRange(strongest_node)) {
      return Join(i, strongest_node);
    }
    of_node_[i] = NewCluster(1);
  }

  // The strong neighbour in the smallest other cluster that i's may be joined with, or -1. Of the
  // two clusters one is always a single node.
  int64_t SmallestStrongNeighbor(int64_t i, float min_weight, int32_t own) const {
    int32_t smallest = kMaxNodes + 1;
    int64_t best = -1;
    view_.Visit(i, [&](int64_t j, float w) {
      if (w < min_weight || !InRange(j)) return;
      if (of_node_[j] >= 0 && of_node_[j] == of_node_[i]) return;
      const int32_t size = SizeOf(j);
      if (size >= smallest || own + size > kMaxNodes) return;
      if (of_node_[i] >= 0 && of_node_[j] >= 0) return;
      smallest = size;
      best = j;
    });
    return best;
  }

  void Join(int64_t i, int64_t j) {
    if (of_node_[i] < 0 && of_node_[j] < 0) of_node_[j] = NewCluster(1);
    const int64_t single = of_node_[i] < 0 ? i : j;
    of_node_[single] = of_node_[single == i ? j : i];
    ++sizes_[of_node_[single]];
  }

  int32_t NewCluster(int32_t size) {
    sizes_.push_back(size);
    return static_cast<int32_t>(sizes_.size()) - 1;
  }
  bool InRange(int64_t j) const { return j >= begin_ && j < end_; }

  const View& view_;
  int64_t begin_, end_;
  std::vector<int32_t>& of_node_;
  std::vector<int32_t> sizes_;
};

template <typename View>
Clusters Cluster(const View& view, int64_t range_nodes, ThreadPool& pool) {
  Clusters clusters;
  const int64_t nodes = view.NodeCount();
  const int64_t ranges = (nodes + range_nodes - 1) / range_nodes;
  clusters.range_nodes = range_nodes;
  clusters.of_node.assign(nodes, -1);
  clusters.first.assign(ranges + 1, 0);
  pool.ForEach(ranges, [&](int64_t k, int) {
    const int64_t begin = k * range_nodes, end = std::min(nodes, begin + range_nodes);
    clusters.first[k + 1] = RangeClusterer<View>(view, begin, end, clusters.of_node).Run();
  });
  for (int64_t k = 0; k < ranges; ++k) clusters.first[k + 1] += clusters.first[k];
  clusters.count = clusters.first[ranges];
  pool.ForEach(ranges, [&](int64_t k, int) {
    const int64_t begin = k * range_nodes, end = std::min(nodes, begin + range_nodes);
    const auto offset = static_cast<int32_t>(clusters.first[k]);
    for (int64_t i = begin; i < end; ++i) clusters.of_node[i] += offset;
  });
  return clusters;
}

// Rows of the clusters of one range.
struct Rows {
  std::vector<int64_t> sizes;
  std::vector<int32_t> neighbor;
  std::vector<float> weight;
};

// Position of a coarse neighbour in the current row, by the row's number.
struct Marker {
  std::vector<int32_t> row;
  std::vector<int64_t> position;
};

// Nodes of [begin, end) sorted by cluster, and where each cluster begins.
void SortByCluster(const std::vector<int32_t>& of_node,
                   int64_t begin,
                   int64_t end,
                   int64_t first_cluster,
                   std::vector<int64_t>& starts,
                   std::vector<int64_t>& members) {
  for (int64_t i = begin; i < end; ++i) ++starts[of_node[i] - first_cluster + 1];
  for (size_t c = 1; c < starts.size(); ++c) starts[c] += starts[c - 1];
  members.resize(end - begin);
  std::vector<int64_t> next(starts.begin(), starts.end() - 1);
  for (int64_t i = begin; i < end; ++i) members[next[of_node[i] - first_cluster]++] = i;
}

template <typename View>
Rows CoarseRows(const View& view,
                const Clusters& clusters,
                int64_t range,
                Marker& marker,
                std::vector<float>& data) {
  const int64_t first = clusters.first[range];
  const int64_t count = clusters.first[range + 1] - first;
  const int64_t begin = range * clusters.range_nodes;
  const int64_t end = std::min(view.NodeCount(), begin + clusters.range_nodes);
  std::vector<int64_t> starts(count + 1, 0), members;
  SortByCluster(clusters.of_node, begin, end, first, starts, members);
  Rows rows;
  rows.sizes.resize(count);
  rows.neighbor.reserve(6 * count);
  rows.weight.reserve(6 * count);
  for (int64_t c = 0; c < count; ++c) {
    const auto row = static_cast<int32_t>(first + c);
    const size_t row_begin = rows.neighbor.size();
    double sum = 0.0;
    for (int64_t m = starts[c]; m < starts[c + 1]; ++m) {
      sum += view.Data(members[m]);
      view.Visit(members[m], [&](int64_t j, float w) {
        const int32_t other = clusters.of_node[j];
        if (other == row) return;
        if (marker.row[other] != row) {
          marker.row[other] = row;
          marker.position[other] = static_cast<int64_t>(rows.neighbor.size());
          rows.neighbor.push_back(other);
          rows.weight.push_back(w);
        } else {
          rows.weight[marker.position[other]] += w;
        }
      });
    }
    data[row] = static_cast<float>(sum);
    rows.sizes[c] = static_cast<int64_t>(rows.neighbor.size() - row_begin);
  }
  return rows;
}

template <typename View>
AggregateGraph Coarsen(const View& view, const Clusters& clusters, ThreadPool& pool) {
  AggregateGraph graph;
  graph.data.assign(clusters.count, 0.0f);
  graph.row_begin.assign(clusters.count + 1, 0);
  const auto ranges = static_cast<int64_t>(clusters.first.size()) - 1;
  std::vector<Rows> rows(ranges);
  std::vector<Marker> markers(pool.thread_count());
  pool.ForEach(ranges, [&](int64_t k, int thread) {
    Marker& marker = markers[thread];
    if (marker.row.empty()) {
      marker.row.assign(clusters.count, -1);
      marker.position.assign(clusters.count, 0);
    }
    rows[k] = CoarseRows(view, clusters, k, marker, graph.data);
    int64_t* sizes = graph.row_begin.data() + clusters.first[k] + 1;
    std::copy(rows[k].sizes.begin(), rows[k].sizes.end(), sizes);
  });
  markers.clear();
  for (int64_t c = 0; c < clusters.count; ++c) graph.row_begin[c + 1] += graph.row_begin[c];
  graph.neighbor.resize(graph.row_begin[clusters.count]);
  graph.weight.resize(graph.row_begin[clusters.count]);
  pool.ForEach(ranges, [&](int64_t k, int) {
    const int64_t begin = graph.row_begin[clusters.first[k]];
    std::copy(rows[k].neighbor.begin(), rows[k].neighbor.end(), graph.neighbor.begin() + begin);
    std::copy(rows[k].weight.begin(), rows[k].weight.end(), graph.weight.begin() + begin);
    rows[k] = {};
  });
  return graph;
}

}  // namespace

Clusters ClusterGrid(const GridSystem& system, ThreadPool& pool) {
  return Cluster(GridView{system}, kGridRangeNodes, pool);
}

Clusters ClusterGraph(const AggregateGraph& graph, ThreadPool& pool) {
  return Cluster(GraphView{graph}, kGraphRangeNodes, pool);
}

AggregateGraph CoarsenGrid(const GridSystem& system, const Clusters& clusters, ThreadPool& pool) {
  return Coarsen(GridView{system}, clusters, pool);
}

AggregateGraph CoarsenGraph(const AggregateGraph& graph,
                            const Clusters& clusters,
                            ThreadPool& pool) {
  return Coarsen(GraphView{graph}, clusters, pool);
}

}  // namespace color3d
