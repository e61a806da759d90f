// Small line plots as SVG: errors over seconds. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "core/report/curves.h"

namespace color3d {

// One line of a plot.
struct PlotSeries {
  std::string name;
  std::vector<CurvePoint> points;  // stage and error_name are ignored
};
struct Plot {
  std::string title;
  std::vector<PlotSeries> series;  // in at most 6 colours, with a legend if there are several
  bool log_seconds = false;        // leaves out points at 0 s
  bool log_values = false;         // ignored if a value is not positive
};

// A complete file: the plots in rows of four, with their styles.
std::string FigureSvg(const std::vector<Plot>& plots);

// For a page that has the styles.
std::string PlotSvg(const Plot& plot);

// For a page that has the styles: one plot for each (stage, error_name) of `points`, in the order
// of first appearance. Single points are left out. Plots of residuals have a logarithmic axis.
std::string PlotsSvg(const std::vector<CurvePoint>& points);

// Replaces the five special characters of HTML by entities.
std::string EscapeHtml(const std::string& text);

}  // namespace color3d
