// Coarse levels of the grid solver: weighted graphs whose nodes are small clusters of strongly
// connected nodes of the level above (aggregation multigrid, Notay 2010; clusters follow the
// strongest edge, so that no cluster straddles an edge of the picture). For this folder only.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/grid/grid_solver.h"

namespace color3d {

// Symmetric graph in compressed rows, each edge stored with both of its ends.
struct AggregateGraph {
  std::vector<int64_t> row_begin;  // node_count + 1 entries
  std::vector<int32_t> neighbor;
  std::vector<float> weight;
  std::vector<float> data;  // per node, as in GridSystem

  int64_t NodeCount() const { return static_cast<int64_t>(data.size()); }
};

// Cluster of every node of the finer graph. Nodes without an edge get an arbitrary cluster: their
// values must be zero before a restriction and are ignored after a prolongation.
struct Clusters {
  std::vector<int32_t> of_node;
  int64_t count = 0;
  // Nodes are clustered in fixed ranges of this many, whose clusters are numbered one after
  // another: [first[k], first[k + 1]) are those of the k-th range. Ranges share no cluster.
  int64_t range_nodes = 0;
  std::vector<int64_t> first;
};

Clusters ClusterGrid(const GridSystem& system, ThreadPool& pool);
Clusters ClusterGraph(const AggregateGraph& graph, ThreadPool& pool);

// Galerkin product for piecewise constant interpolation: edges between two clusters add up.
AggregateGraph CoarsenGrid(const GridSystem& system, const Clusters& clusters, ThreadPool& pool);
AggregateGraph CoarsenGraph(const AggregateGraph& graph,
                            const Clusters& clusters,
                            ThreadPool& pool);

}  // namespace color3d
