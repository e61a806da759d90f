#include "core/report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace color3d {
namespace {

constexpr double kWidth = 360.0;
constexpr double kHeight = 220.0;
constexpr double kLeft = 52.0;
constexpr double kRight = 12.0;
constexpr double kTop = 28.0;
constexpr double kBottom = 34.0;
constexpr int kColors = 6;
constexpr size_t kColumns = 4;  // of a file

// Returns 1, 2 or 5 times a power of ten, for at most about four intervals.
double TickStep(double span) {
  const double raw = span / 4.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (double m : {1.0, 2.0, 5.0}) {
    if (raw <= m * power) return m * power;
  }
  return 10.0 * power;
}

// Maps seconds or values to pixels, with round ticks.
class Axis {
 public:
  Axis(double low, double high, double first_px, double last_px, bool logarithmic)
      : first_px_(first_px), last_px_(last_px), logarithmic_(logarithmic) {
    if (logarithmic) {
      AddDecades(low, high);
    } else {
      AddSteps(low, high);
    }
    low_ = Scale(ticks_.front());
    high_ = Scale(ticks_.back());
  }
  double Px(double v) const {
    return first_px_ + (Scale(v) - low_) / (high_ - low_) * (last_px_ - first_px_);
  }
  const std::vector<double>& ticks() const { return ticks_; }

 private:
  double Scale(double v) const { return logarithmic_ ? std::log10(v) : v; }

  void AddSteps(double low, double high) {
    if (!(high > low)) high = low + std::max(1.0, std::abs(low));
    const double step = TickStep(high - low);
    const auto first = std::llround(std::floor(low / step));
    const auto last = std::llround(std::ceil(high / step));
    for (auto k = first; k <= last; ++k) ticks_.push_back(static_cast<double>(k) * step);
  }

  // 1, 2, 5, 10, 20, ... around the range.
  void AddDecades(double low, double high) {
    const int first = static_cast<int>(std::floor(std::log10(low)));
    for (int power = first; ticks_.size() < 2 || ticks_.back() < high; ++power) {
      for (const double m : {1.0, 2.0, 5.0}) {
        const double tick = m * std::pow(10.0, power);
        if (!ticks_.empty() && tick <= low) ticks_.clear();
        if (ticks_.size() < 2 || ticks_.back() < high) ticks_.push_back(tick);
      }
    }
  }

  std::vector<double> ticks_;
  double first_px_, last_px_;
  double low_ = 0.0, high_ = 1.0;
  bool logarithmic_;
};

constexpr size_t kMaxMarkers = 12;  // lines with more points have no dots

// A dot at each point, so that a line of one point is visible.
std::string Markers(const PlotSeries& series,
                    const std::string& color,
                    const Axis& x_axis,
                    const Axis& y_axis,
                    bool log_seconds) {
  std::string svg;
  if (series.points.size() > kMaxMarkers) return svg;
  for (const CurvePoint& p : series.points) {
    if (log_seconds && !(p.seconds > 0.0)) continue;
    svg += fmt::format("<circle class=\"{}\" r=\"2\" cx=\"{:.1f}\" cy=\"{:.1f}\"/>",
                       color,
                       x_axis.Px(p.seconds),
                       y_axis.Px(p.value));
  }
  return svg;
}

// Places the legend away from the ends of the lines.
bool LegendAtTop(const Plot& plot, const Axis& y_axis) {
  double sum = 0.0;
  int count = 0;
  for (const PlotSeries& series : plot.series) {
    if (series.points.empty()) continue;
    sum += y_axis.Px(series.points.back().value);
    ++count;
  }
  return count > 0 && sum / count > 0.5 * (kTop + kHeight - kBottom);
}

std::string TextAt(
    double x, double y, const char* anchor, const char* style, const std::string& t) {
  return fmt::format("<text class=\"{}\" text-anchor=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>",
                     style,
                     anchor,
                     x,
                     y,
                     t);
}

std::string Line(const std::string& color, double x1, double x2, double y) {
  return fmt::format(
      "<line class=\"{0}\" x1=\"{1:.1f}\" x2=\"{2:.1f}\" y1=\"{3:.1f}\" y2=\"{3:.1f}\"/>",
      color,
      x1,
      x2,
      y);
}

std::string Grid(const Axis& x_axis, const Axis& y_axis) {
  std::string svg;
  for (const double v : y_axis.ticks()) {
    svg += Line("g", kLeft, kWidth - kRight, y_axis.Px(v)) +
           TextAt(kLeft - 5, y_axis.Px(v) + 3.5, "end", "n", fmt::format("{:.4g}", v));
  }
  for (const double v : x_axis.ticks()) {
    svg += TextAt(x_axis.Px(v), kHeight - kBottom + 14, "middle", "n", fmt::format("{:.4g}", v));
  }
  return svg + TextAt(kWidth - kRight, kHeight - 6, "end", "n", "seconds");
}

// The elements of a plot, without the enclosing <svg>.
std::string PlotElements(const Plot& plot) {
  const auto shown = [&](const CurvePoint& p) { return !plot.log_seconds || p.seconds > 0.0; };
  double min_x = plot.log_seconds ? 1e30 : 0.0, max_x = 0.0, min_y = 1e30, max_y = -1e30;
  for (const PlotSeries& series : plot.series) {
    for (const CurvePoint& p : series.points) {
      if (!shown(p)) continue;
      min_x = std::min(min_x, p.seconds);
      max_x = std::max(max_x, p.seconds);
      min_y = std::min(min_y, p.value);
      max_y = std::max(max_y, p.value);
    }
  }
  std::string svg = TextAt(8, 16, "start", "t", EscapeHtml(plot.title));
  if (min_y > max_y) return svg;
  const Axis x_axis(min_x, max_x, kLeft, kWidth - kRight, plot.log_seconds);
  const Axis y_axis(min_y, max_y, kHeight - kBottom, kTop, plot.log_values && min_y > 0.0);
  svg += Grid(x_axis, y_axis);
  const bool legend_at_top = LegendAtTop(plot, y_axis);
  for (size_t i = 0; i < plot.series.size(); ++i) {
    const std::string color = fmt::format("c c{}", i % kColors);
    svg += fmt::format("<polyline class=\"{}\" points=\"", color);
    for (const CurvePoint& p : plot.series[i].points) {
      if (!shown(p)) continue;
      svg += fmt::format("{:.1f},{:.1f} ", x_axis.Px(p.seconds), y_axis.Px(p.value));
    }
    svg += "\"/>" + Markers(plot.series[i], color, x_axis, y_axis, plot.log_seconds);
    if (plot.series.size() == 1) continue;
    const double row = 14.0 * static_cast<double>(i);
    const double y = legend_at_top ? kTop + 10.0 + row : kHeight - kBottom - 8.0 - row;
    svg += Line(color, kWidth - kRight - 18, kWidth - kRight, y - 3.5) +
           TextAt(kWidth - kRight - 22, y, "end", "n", EscapeHtml(plot.series[i].name));
  }
  return svg;
}

std::string ViewBox(double width, double height) {
  return fmt::format("viewBox=\"0 0 {:.0f} {:.0f}\"", width, height);
}

}  // namespace

std::string EscapeHtml(const std::string& text) {
  constexpr std::string_view kSpecial = "&<>\"'";
  constexpr const char* kEntities[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string escaped;
  for (const char c : text) {
    const size_t special = kSpecial.find(c);
    if (special == std::string_view::npos) {
      escaped += c;
    } else {
      escaped += kEntities[special];
    }
  }
  return escaped;
}

std::string PlotSvg(const Plot& plot) {
  return fmt::format("<svg class=\"plot\" role=\"img\" aria-label=\"{}\" {}>{}</svg>",
                     EscapeHtml(plot.title),
                     ViewBox(kWidth, kHeight),
                     PlotElements(plot));
}

std::string PlotsSvg(const std::vector<CurvePoint>& points) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<CurvePoint>> groups;
  for (const CurvePoint& p : points) {
    const std::string title = p.stage + ": " + p.error_name;
    if (groups[title].empty()) order.push_back(title);
    groups[title].push_back(p);
  }
  std::string svg;
  for (const std::string& title : order) {
    if (groups[title].size() < 2) continue;
    svg += PlotSvg({title, {{"", groups[title]}}, false, title.ends_with("residual")});
  }
  return svg;
}

std::string FigureSvg(const std::vector<Plot>& plots) {
  const size_t columns = std::clamp<size_t>(plots.size(), 1, kColumns);
  const size_t rows = std::max<size_t>(1, (plots.size() + columns - 1) / columns);
  const double width = kWidth * static_cast<double>(columns);
  const double height = kHeight * static_cast<double>(rows);
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" " + ViewBox(width, height) +
                    " font-family=\"sans-serif\"><style>"
                    ".t{font-size:13px;font-weight:600}.n{font-size:10px;fill:#555}"
                    ".g{stroke:#ddd}.c{fill:none;stroke-width:1.6}"
                    ".c0{stroke:#c0392b}.c1{stroke:#2471a3}.c2{stroke:#1e8449}"
                    ".c3{stroke:#b9770e}.c4{stroke:#6c3483}.c5{stroke:#333}"
                    "</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>";
  for (size_t i = 0; i < plots.size(); ++i) {
    svg += fmt::format("<g transform=\"translate({:.0f},{:.0f})\">{}</g>",
                       kWidth * static_cast<double>(i % columns),
                       kHeight * static_cast<double>(i / columns),
                       PlotElements(plots[i]));
  }
  return svg + "</svg>\n";
}

}  // namespace color3d
