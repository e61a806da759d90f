// The results of a suite as one HTML page without external resources. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/suite/suite_table.h"

namespace color3d {

// Error against seconds (logarithmic) of the cells of a scene as SVG, with the frontier and its
// knee. Empty if no cell has seconds.
std::string FrontierSvg(const SceneResults& scene);

// `note`: one sentence, e.g. machine and commit.
std::string SuitePage(const std::vector<SceneResults>& scenes,
                      const std::vector<PresetSummary>& presets,
                      const std::vector<ClaimResult>& claims,
                      const std::string& note);

}  // namespace color3d
