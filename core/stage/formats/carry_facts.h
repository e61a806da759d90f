// carry.json: coverage of the scene by the key views. Written by carry_color, read by later stages.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/stage/context/stage_context.h"

namespace color3d {

struct CarryFacts {
  // Share of the pixels that a key view shows, mean over the views that are not key views, 0..1;
  // nullopt if it was not measured.
  std::optional<double> coverage;
  std::vector<std::string> key_views;           // names
  std::map<std::string, double> view_coverage;  // of every view, by its name
};

// Returns empty facts if there is no such input. Throws Error{kInvalidArgument} if it is damaged.
CarryFacts ReadCarryFacts(const StageContext& context);
void WriteCarryFacts(const CarryFacts& facts, StageContext& context);

}  // namespace color3d
