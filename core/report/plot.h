// Small line plots as inline SVG: error against seconds.
#pragma once

#include <string>
#include <vector>

#include "core/report/curves.h"

namespace color3d {

// One plot for each (stage, error_name) among `points`, in order of first appearance.
std::string PlotsSvg(const std::vector<CurvePoint>& points);

// The five characters that HTML gives a meaning, replaced by entities.
std::string EscapeHtml(const std::string& text);

}  // namespace color3d
