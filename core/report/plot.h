// Small line plots as SVG: error against seconds.
#pragma once

#include <string>
#include <vector>

#include "core/report/curves.h"

namespace color3d {

// Lines that share a pair of axes.
struct PlotSeries {
  std::string name;
  std::vector<CurvePoint> points;  // their stage and error_name are not looked at
};
struct Plot {
  std::string title;
  std::vector<PlotSeries> series;  // at most 6 colours; a legend when there are several
  bool log_seconds = false;        // points at 0 s are left out then
  bool log_values = false;         // unless a value is not positive
};

// A file of its own: the plots in rows of four, with their styles.
std::string FigureSvg(const std::vector<Plot>& plots);

// For a page that brings the styles: one plot for each (stage, error_name) among `points`, in order
// of first appearance; single points are no curve and are left out. Those of residuals have a
// logarithmic axis.
std::string PlotsSvg(const std::vector<CurvePoint>& points);

// The five characters that HTML gives a meaning, replaced by entities.
std::string EscapeHtml(const std::string& text);

}  // namespace color3d
