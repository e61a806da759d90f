// How much of the scene the key views show.
#pragma once

#include <vector>

#include "core/stage/carry/carry_by_kind.h"

namespace color3d {

// Share of the pixels of a view that count as covered, 0..1.
double CoveredShare(const CarriedColor& color);

// Writes kCarryFacts. `coverage`: CoveredShare of each view of the scene. Returns the mean of the
// views that are not key views.
double WriteCoverage(const CarryInputs& inputs,
                     const std::vector<double>& coverage,
                     StageContext& context);

// Warns if the key views show next to nothing of the other views. `mean`: from WriteCoverage.
void WarnOfSmallCoverage(double mean, StageContext& context);

}  // namespace color3d
