// Options of the stage carry_color.
#pragma once

#include <vector>

#include "core/carry/carry.h"
#include "core/carry/plane_sweep.h"
#include "core/film/film_carry.h"
#include "core/stage/options/key_color_options.h"

namespace color3d {

struct CarryColorOptions {
  int max_side_px = 500;    // of the carried maps, 64..4096
  int depth_side_px = 300;  // at which depth is measured, 64..2048
  int depth_sources = 4;    // views that each view is compared with, 1..16
  PlaneSweepOptions sweep;
  CarryOptions carry;
  FilmCarryOptions film;                // of a film: by motion
  std::vector<FurtherKeyView> further;  // in the order of their importance, at most 16
  void Validate() const;
  bool operator==(const CarryColorOptions&) const = default;
};

}  // namespace color3d
