// Nearest neighbours of cells in a bank of coloured cells. Internal to core/keycolor.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/keycolor/references/cell_features.h"

namespace color3d {

struct CellBank {
  CellMatrix features;
  CellMatrix ab;                   // [cells, 2]
  std::vector<int32_t> reference;  // that the cell is from
};

struct CellMatches {
  CellMatrix ab;                   // [cells, 2]: blend of the nearest, by distance
  std::vector<float> confidence;   // 0..1
  std::vector<int32_t> reference;  // of the nearest
};

// Confidence of a match = closeness (its squared distance against `distance_scale`) x mutuality
// (whether another cell is nearer to the matched one) x agreement of the blended colours.
CellMatches MatchCells(const CellMatrix& queries,
                       const CellBank& bank,
                       int neighbours,
                       double distance_scale,
                       ThreadPool& pool,
                       const CancellationToken& cancel);

// Squared distance at which a match is no better than chance, half-way (geometrically) between how
// near cells of the references are to their nearest others and how far two of them are apart.
double DistanceScale(const CellMatrix& sample, const CellMatrix& features);

}  // namespace color3d
