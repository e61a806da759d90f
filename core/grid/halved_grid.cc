#include "core/grid/halved_grid.h"

#include <algorithm>

namespace color3d {
namespace {

// Share of the diagonals of the pixels in the upright edges of the cells with which a region of
// equal weights spreads as before: 1 / (2 - sqrt(2)).
constexpr float kDiagonalShare = 1.70710678f;
constexpr float kLeast = 1e-9f;

// From the middle of one cell to that of the next: half an edge, an edge, half an edge.
float InSeries(float before, float between, float after) {
  if (between <= 0.0f) return 0.0f;
  return 1.0f / (0.5f / std::max(before, kLeast) + 1.0f / between + 0.5f / std::max(after, kLeast));
}

// Weights of the edges of a pixel, 0 beyond the borders.
struct FineEdges {
  const GridSystem& s;
  bool Has(int x, int y) const { return x >= 0 && x < s.width && y >= 0 && y < s.height; }
  float At(const GridPlane& plane, int x, int y) const {
    return Has(x, y) ? plane[static_cast<int64_t>(y) * s.width + x] : 0.0f;
  }
  float Right(int x, int y) const { return At(s.right, x, y); }
  float Down(int x, int y) const { return At(s.down, x, y); }
  float DownRight(int x, int y) const { return At(s.down_right, x, y); }
  float DownLeft(int x, int y) const { return At(s.down_left, x, y); }
};

// Edge to the cell on the right of the one whose first pixel is (x, y).
float RightOfCell(const FineEdges& e, int x, int y) {
  // The last cell may be one pixel wide.
  const int beyond = x + 3 < e.s.width ? x + 2 : x;
  float sum = 0.0f;
  for (int row = y; row < y + 2; ++row) {
    sum += InSeries(e.Right(x, row), e.Right(x + 1, row), e.Right(beyond, row));
  }
  const float crossing = InSeries(e.Right(x, y), e.DownRight(x + 1, y), e.Right(beyond, y + 1)) +
                         InSeries(e.Right(x, y + 1), e.DownLeft(x + 2, y), e.Right(beyond, y));
  return sum + 0.5f * kDiagonalShare * crossing;
}

float DownOfCell(const FineEdges& e, int x, int y) {
  const int beyond = y + 3 < e.s.height ? y + 2 : y;
  float sum = 0.0f;
  for (int column = x; column < x + 2; ++column) {
    sum += InSeries(e.Down(column, y), e.Down(column, y + 1), e.Down(column, beyond));
  }
  const float crossing = InSeries(e.Down(x, y), e.DownRight(x, y + 1), e.Down(x + 1, beyond)) +
                         InSeries(e.Down(x + 1, y), e.DownLeft(x + 1, y + 1), e.Down(x, beyond));
  return sum + 0.5f * kDiagonalShare * crossing;
}

}  // namespace

GridSystem HalvedGrid(const GridSystem& fine) {
  GridSystem half((fine.width + 1) / 2, (fine.height + 1) / 2);
  const FineEdges e{fine};
  for (int cy = 0; cy < half.height; ++cy) {
    for (int cx = 0; cx < half.width; ++cx) {
      const int x = 2 * cx, y = 2 * cy;
      const int64_t i = static_cast<int64_t>(cy) * half.width + cx;
      const bool is_last = cx + 1 == half.width;
      half.data[i] = e.At(fine.data, x, y) + e.At(fine.data, x + 1, y) + e.At(fine.data, x, y + 1) +
                     e.At(fine.data, x + 1, y + 1);
      if (!is_last) half.right[i] = RightOfCell(e, x, y);
      if (cy + 1 == half.height) continue;
      half.down[i] = DownOfCell(e, x, y);
      if (!is_last) {
        half.down_right[i] =
            InSeries(e.DownRight(x, y), e.DownRight(x + 1, y + 1), e.DownRight(x + 2, y + 2));
      }
      if (cx > 0) {
        half.down_left[i] =
            InSeries(e.DownLeft(x + 1, y), e.DownLeft(x, y + 1), e.DownLeft(x - 1, y + 2));
      }
    }
  }
  return half;
}

}  // namespace color3d
