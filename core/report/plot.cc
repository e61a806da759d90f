#include "core/report/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

namespace color3d {
namespace {

constexpr double kWidth = 360.0;
constexpr double kHeight = 220.0;
constexpr double kLeft = 52.0;
constexpr double kRight = 12.0;
constexpr double kTop = 28.0;
constexpr double kBottom = 34.0;

std::string Format(const char* format, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof(buffer), format, value);
  return buffer;
}

// 1, 2 or 5 times a power of ten, giving at most about four intervals.
double TickStep(double span) {
  const double raw = span / 4.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (double m : {1.0, 2.0, 5.0}) {
    if (raw <= m * power) return m * power;
  }
  return 10.0 * power;
}

struct Axis {
  double low = 0.0;
  double high = 1.0;
  double step = 0.25;

  Axis(double min_value, double max_value) {
    if (!(max_value > min_value)) max_value = min_value + std::max(1.0, std::abs(min_value));
    step = TickStep(max_value - min_value);
    low = std::floor(min_value / step) * step;
    high = std::ceil(max_value / step) * step;
  }
  double Fraction(double v) const { return (v - low) / (high - low); }
};

std::string OnePlot(const std::string& title, const std::vector<const CurvePoint*>& points) {
  double min_y = points[0]->value;
  double max_y = min_y;
  double max_x = 0.0;
  for (const CurvePoint* p : points) {
    min_y = std::min(min_y, p->value);
    max_y = std::max(max_y, p->value);
    max_x = std::max(max_x, p->seconds);
  }
  const Axis x_axis(0.0, max_x);
  const Axis y_axis(min_y, max_y);
  const auto x_px = [&](double v) {
    return kLeft + x_axis.Fraction(v) * (kWidth - kLeft - kRight);
  };
  const auto y_px = [&](double v) {
    return kHeight - kBottom - y_axis.Fraction(v) * (kHeight - kTop - kBottom);
  };
  std::string svg = "<svg class=\"plot\" viewBox=\"0 0 " + Format("%.0f", kWidth) + " " +
                    Format("%.0f", kHeight) + "\"><text x=\"8\" y=\"16\" class=\"t\">" +
                    EscapeHtml(title) + "</text>";
  for (double v = y_axis.low; v <= y_axis.high + 1e-9 * y_axis.step; v += y_axis.step) {
    svg += "<line class=\"g\" x1=\"" + Format("%.1f", kLeft) + "\" x2=\"" +
           Format("%.1f", kWidth - kRight) + "\" y1=\"" + Format("%.1f", y_px(v)) + "\" y2=\"" +
           Format("%.1f", y_px(v)) + "\"/><text class=\"n\" text-anchor=\"end\" x=\"" +
           Format("%.1f", kLeft - 5) + "\" y=\"" + Format("%.1f", y_px(v) + 3.5) + "\">" +
           Format("%.4g", v) + "</text>";
  }
  for (double v = x_axis.low; v <= x_axis.high + 1e-9 * x_axis.step; v += x_axis.step) {
    svg += "<text class=\"n\" text-anchor=\"middle\" x=\"" + Format("%.1f", x_px(v)) + "\" y=\"" +
           Format("%.1f", kHeight - kBottom + 14) + "\">" + Format("%.4g", v) + "</text>";
  }
  svg += "<text class=\"n\" text-anchor=\"end\" x=\"" + Format("%.1f", kWidth - kRight) +
         "\" y=\"" + Format("%.1f", kHeight - 6) +
         "\">seconds</text><polyline class=\"c\" points=\"";
  for (const CurvePoint* p : points) {
    svg += Format("%.1f", x_px(p->seconds)) + "," + Format("%.1f", y_px(p->value)) + " ";
  }
  return svg + "\"/></svg>";
}

}  // namespace

std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string PlotsSvg(const std::vector<CurvePoint>& points) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<const CurvePoint*>> groups;
  for (const CurvePoint& p : points) {
    const std::string title = p.stage + ": " + p.error_name;
    if (groups[title].empty()) order.push_back(title);
    groups[title].push_back(&p);
  }
  std::string svg;
  for (const std::string& title : order) svg += OnePlot(title, groups[title]);
  return svg;
}

}  // namespace color3d
