// carry.json: how much of the scene the key views show, and which one to colour next. Written by
// carry_color, read by the stages after it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/stage/stage.h"

namespace color3d {

struct CarryFacts {
  // The view to colour next, by shares of the tracked points of structure-from-motion (0..1): those
  // that a key view shows now, and with this view. Pixels are not known before it is coloured.
  struct Next {
    std::string name;
    double coverage_now = 0.0;
    double coverage_with = 0.0;
  };

  // Share of the other views' pixels that a key view shows, mean over the views that are not key
  // views, 0..1; nothing when nobody measured it.
  std::optional<double> coverage;
  std::vector<std::string> key_views;  // names
  std::optional<Next> next;            // none: no view would add any
};

// Empty facts when the job has no such input. Throws Error{kInvalidArgument} when it is damaged.
CarryFacts ReadCarryFacts(const StageContext& context);
// `coverage`: of every view of the scene, for people; the stages do not read it.
void WriteCarryFacts(const CarryFacts& facts,
                     const Scene& scene,
                     const std::vector<double>& coverage,
                     StageContext& context);

}  // namespace color3d
