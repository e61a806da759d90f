// Options of the stage carry_color.
#pragma once

#include <string>
#include <vector>

#include "core/carry/carry.h"
#include "core/carry/plane_sweep.h"
#include "core/film/film_carry.h"

namespace color3d {

struct CarryColorOptions {
  int max_side_px = 500;    // of the carried maps, 64..4096
  int depth_side_px = 300;  // at which depth is measured, 64..2048
  int depth_sources = 4;    // views that each view is compared with, 1..16
  PlaneSweepOptions sweep;
  CarryOptions carry;
  // Of static scenes: nothing is carried if the views agree less (MeanAgreement), 0..1.
  double min_agreement = 0.5;
  FilmCarryOptions film;  // of films
  // Names or unique file stems, in order of importance, at most kMaxAdditionalKeyViews. Each gives
  // only the colours that the key views before it do not give. In a film it colours the frames of
  // its shot that are nearest to it.
  std::vector<std::string> additional_key_views;
  void Validate() const;
  bool operator==(const CarryColorOptions&) const = default;
};

}  // namespace color3d
