// The system of a picture at half its size. Pure function. For this folder only.
#pragma once

#include "core/grid/grid_solver.h"

namespace color3d {

// A cell is two by two pixels, fewer at the right and lower borders. Its edges conduct like those
// of its pixels, in series along the way and in parallel across it, so that smooth regions keep
// their spread and a thin edge stays one. Data are summed; pins are not taken over.
GridSystem HalvedGrid(const GridSystem& fine);

}  // namespace color3d
