// Per-pixel loops of the grid solver for the instruction set in use (core/simd/instruction_set.h).
// For this folder only.
#pragma once

#include <array>
#include <cstdint>

#include "core/grid/grid_solver.h"

namespace color3d {

// Pixels are processed in chunks of this size for every number of threads, so that sums do not
// depend on it. A multiple of the widest register.
inline constexpr int64_t kGridChunk = 1 << 16;
// Margin of a GridPlane beyond a row and a pixel: one widest register.
inline constexpr int64_t kGridMargin = 16;

// Two components of a vector over the pixels.
struct GridVector {
  GridPlane a, b;
};
using GridPair = std::array<double, 2>;  // one number per component

// For pixels [begin, end), begin a multiple of 16; up to 15 pixels past the end are written, too,
// when `end` is the end of the picture (they lie in the margin and become zero).
// out = f - A u.
void GridResidual(const GridSystem& system,
                  const GridVector& u,
                  const GridVector& f,
                  int64_t begin,
                  int64_t end,
                  GridVector& out);
// out = A u. Returns u . A u of the range.
GridPair GridApply(
    const GridSystem& system, const GridVector& u, int64_t begin, int64_t end, GridVector& out);
// out = u + scale (f - A u): a Jacobi step, with the damped inverse of the diagonal as scale.
void GridJacobi(const GridSystem& system,
                const GridPlane& scale,
                const GridVector& u,
                const GridVector& f,
                int64_t begin,
                int64_t end,
                GridVector& out);
// out = scale f: the Jacobi step from zero.
void GridScale(
    const GridPlane& scale, const GridVector& f, int64_t begin, int64_t end, GridVector& out);
// x . y of the range.
GridPair GridDot(const GridVector& x, const GridVector& y, int64_t begin, int64_t end);
// x = p x + q y.
void GridCombine(const GridPair& p,
                 GridVector& x,
                 const GridPair& q,
                 const GridVector& y,
                 int64_t begin,
                 int64_t end);

}  // namespace color3d
