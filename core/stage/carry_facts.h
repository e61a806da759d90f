// carry.json: how much of the scene the key views show, and which one to colour next. Written by
// carry_color, read by the stages after it. For this folder.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/stage/stage.h"

namespace color3d {

struct CarryFacts {
  struct Next {
    std::string name;
    double coverage_now = 0.0;
    double coverage_with = 0.0;
  };

  // Mean over the views that are not key views, 0..1; nothing when nobody measured it.
  std::optional<double> coverage;
  std::vector<std::string> key_views;                    // names
  std::vector<std::pair<std::string, double>> per_view;  // name and coverage of all views
  std::optional<Next> next;                              // none: no view would add any
};

// Empty facts when the job has no such input. Throws Error{kInvalidArgument} when it is damaged.
CarryFacts ReadCarryFacts(const StageContext& context);
void WriteCarryFacts(const CarryFacts& facts, StageContext& context);

}  // namespace color3d
