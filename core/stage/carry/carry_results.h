// How much of the scene the key views show.
#pragma once

#include <vector>

#include "core/stage/carry/carry_by_kind.h"

namespace color3d {

// Share of the pixels of a view that count as covered, 0..1.
double CoveredShare(const CarriedColor& color);

// Writes kCarryFacts and warns when the key views show next to nothing of the other views.
// `coverage`: CoveredShare of each view of the scene.
void WriteCoverage(const CarryInputs& inputs,
                   const std::vector<double>& coverage,
                   StageContext& context);

}  // namespace color3d
