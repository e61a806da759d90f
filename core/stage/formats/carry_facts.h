// carry.json: how much of the scene the key views show. Written by
// carry_color, read by the stages after it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/stage/context/stage_context.h"

namespace color3d {

struct CarryFacts {
  // Share of the other views' pixels that a key view shows, mean over the views that are not key
  // views, 0..1; nothing when nobody measured it.
  std::optional<double> coverage;
  std::vector<std::string> key_views;           // names
  std::map<std::string, double> view_coverage;  // of every view, by its name
};

// Empty facts when the job has no such input. Throws Error{kInvalidArgument} when it is damaged.
CarryFacts ReadCarryFacts(const StageContext& context);
void WriteCarryFacts(const CarryFacts& facts, StageContext& context);

}  // namespace color3d
