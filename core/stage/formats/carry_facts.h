// carry.json: the share of the scene that the key views show. Written by carry_color, read by later
// stages.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/stage/context/stage_context.h"

namespace color3d {

struct CarryFacts {
  // Mean share of the pixels that a key view shows, over the views that are not key views, 0..1;
  // nothing: not measured.
  std::optional<double> coverage;
  std::vector<std::string> key_views;           // names
  std::map<std::string, double> view_coverage;  // of every view, by its name
};

// Empty facts without this input. Throws Error{kInvalidArgument} when it is damaged.
CarryFacts ReadCarryFacts(const StageContext& context);
void WriteCarryFacts(const CarryFacts& facts, StageContext& context);

}  // namespace color3d
