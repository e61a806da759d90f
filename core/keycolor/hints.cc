#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/keycolor/grid_solver.h"
#include "core/keycolor/keycolor.h"

namespace color3d {
namespace {

// Edge weights are at most 1: a hinted pixel keeps its colour to a few thousandths.
constexpr double kHintWeight = 1000.0;
// Least weight of an edge: regions without a hint of their own take their neighbours' colour.
constexpr double kWeightFloor = 1e-5;
constexpr double kLeastCoverage = 1e-3;
constexpr float kAlphaOfHint = 0.5f;
constexpr float kChromaOfHint = 6.0f;
constexpr int kGuideRadius = 2;
constexpr float kGuideVarianceFloor = 20.0f;

void CheckRange(const char* field, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw InvalidArgument(std::string("hint option ") + field + " is " + std::to_string(value) +
                          ", allowed are " + std::to_string(low) + " to " + std::to_string(high));
  }
}

void CheckLuminance(const Image& luminance) {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the key view's luminance must have 1 channel, it has " +
                          std::to_string(luminance.channels));
  }
  for (float value : luminance.data) {
    if (!std::isfinite(value)) {
      throw InvalidArgument("the key view's luminance holds a value that is not finite");
    }
  }
}

// Hints on the solver's grid: how much of each pixel is hinted, and the mean colour there.
struct HintMap {
  Image coverage;  // 1 channel, 0..1
  Image ab;        // 2 channels, already divided by the coverage
};

// w = exp(-dL^2 / (2 sigma^2)), by Levin et al. 2004 with a fixed sigma; diagonal neighbours are
// further away and count less.
GridSystem BuildSystem(const Image& l, double sigma) {
  GridSystem system(l.width, l.height);
  const double factor = -0.5 / (sigma * sigma);
  auto weight = [&](int x0, int y0, int x1, int y1) {
    const double difference = l.At(0, y0, x0) - l.At(0, y1, x1);
    const double distance = x0 != x1 && y0 != y1 ? std::sqrt(2.0) : 1.0;
    return (std::exp(factor * difference * difference) + kWeightFloor) / distance;
  };
  for (int y = 0; y < l.height; ++y) {
    for (int x = 0; x < l.width; ++x) {
      const size_t i = static_cast<size_t>(y) * l.width + x;
      const bool has_right = x + 1 < l.width;
      const bool has_down = y + 1 < l.height;
      if (has_right) system.right[i] = weight(x, y, x + 1, y);
      if (has_down) system.down[i] = weight(x, y, x, y + 1);
      if (has_right && has_down) system.down_right[i] = weight(x, y, x + 1, y + 1);
      if (x > 0 && has_down) system.down_left[i] = weight(x, y, x - 1, y + 1);
    }
  }
  return system;
}

HintSolution Solve(const Image& luminance,
                   const Image& small,
                   const HintMap& hints,
                   const HintOptions& options,
                   ProgressObserver& progress,
                   const CancellationToken& cancel) {
  GridSystem system = BuildSystem(small, options.sigma);
  std::vector<double> target(2 * small.PlaneSize(), 0.0);
  HintSolution solution;
  for (size_t i = 0; i < small.PlaneSize(); ++i) {
    if (hints.coverage.data[i] < kLeastCoverage) continue;
    ++solution.hinted_pixels;
    system.data[i] = kHintWeight * hints.coverage.data[i];
    target[2 * i] = hints.ab.Plane(0)[i];
    target[2 * i + 1] = hints.ab.Plane(1)[i];
  }
  const GridSolution solved = SolveGridSystem(
      system,
      target,
      options.tolerance,
      options.max_iterations,
      [&](int iteration, double residual) {
        progress.OnError(iteration, "relative_residual", residual);
        progress.OnProgress(iteration, 0, "spreading the colour hints");
      },
      cancel);
  if (!solved.converged) {
    progress.OnWarning(
        "colour hints: the solver stopped after " + std::to_string(solved.iterations) +
        " iterations at a relative residual of " + std::to_string(solved.relative_residual));
  }
  solution.iterations = solved.iterations;
  solution.relative_residual = solved.relative_residual;
  Image ab(small.width, small.height, 2);
  for (size_t i = 0; i < small.PlaneSize(); ++i) {
    ab.Plane(0)[i] = static_cast<float>(solved.u[2 * i]);
    ab.Plane(1)[i] = static_cast<float>(solved.u[2 * i + 1]);
  }
  const bool reduced = small.width != luminance.width || small.height != luminance.height;
  solution.ab =
      reduced ? UpsampleGuided(ab, luminance, kGuideRadius, kGuideVarianceFloor) : std::move(ab);
  return solution;
}

// Mask and colour of the strokes at full size, reduced by area so that thin strokes survive.
HintMap MapFromStrokes(const Image& strokes, int width, int height) {
  Image rgb(strokes.width, strokes.height, 3);
  std::copy_n(strokes.data.begin(), rgb.data.size(), rgb.data.begin());
  for (float& value : rgb.data) value = std::isfinite(value) ? value : 0.0f;
  const Image lab = LabFromSrgb(rgb);
  Image coverage(strokes.width, strokes.height, 1);
  Image weighted(strokes.width, strokes.height, 2);
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    const float a = lab.Plane(1)[i];
    const float b = lab.Plane(2)[i];
    const bool hinted = strokes.channels == 4 ? strokes.Plane(3)[i] > kAlphaOfHint
                                              : std::hypot(a, b) > kChromaOfHint;
    if (!hinted) continue;
    coverage.data[i] = 1.0f;
    weighted.Plane(0)[i] = a;
    weighted.Plane(1)[i] = b;
  }
  HintMap map{Resize(coverage, width, height), Resize(weighted, width, height)};
  for (size_t i = 0; i < map.coverage.PlaneSize(); ++i) {
    const float share = std::max(map.coverage.data[i], static_cast<float>(kLeastCoverage));
    map.ab.Plane(0)[i] /= share;
    map.ab.Plane(1)[i] /= share;
  }
  return map;
}

// Discs; where several overlap, their colours are averaged. At least the pixel under the centre.
HintMap MapFromHints(const std::vector<ColorHint>& hints, double scale, int width, int height) {
  HintMap map{Image(width, height, 1), Image(width, height, 2)};
  for (const ColorHint& hint : hints) {
    const double cx = hint.x_px * scale;
    const double cy = hint.y_px * scale;
    const double radius = hint.radius_px * scale;
    const int center_x = std::min(static_cast<int>(cx), width - 1);
    const int center_y = std::min(static_cast<int>(cy), height - 1);
    const int reach = static_cast<int>(std::min(radius + 1.0, 1.0 + width + height));
    for (int y = std::max(0, center_y - reach); y <= std::min(height - 1, center_y + reach); ++y) {
      for (int x = std::max(0, center_x - reach); x <= std::min(width - 1, center_x + reach); ++x) {
        const bool inside = std::hypot(x + 0.5 - cx, y + 0.5 - cy) <= radius;
        if (!inside && !(x == center_x && y == center_y)) continue;
        map.coverage.At(0, y, x) += 1.0f;
        map.ab.At(0, y, x) += static_cast<float>(hint.a);
        map.ab.At(1, y, x) += static_cast<float>(hint.b);
      }
    }
  }
  for (size_t i = 0; i < map.coverage.PlaneSize(); ++i) {
    const float count = std::max(map.coverage.data[i], 1.0f);
    map.ab.Plane(0)[i] /= count;
    map.ab.Plane(1)[i] /= count;
    map.coverage.data[i] = std::min(map.coverage.data[i], 1.0f);
  }
  return map;
}

void CheckHints(const std::vector<ColorHint>& hints, const Image& luminance) {
  if (hints.empty()) throw InvalidArgument("there is no colour hint; give at least one");
  for (size_t i = 0; i < hints.size(); ++i) {
    const ColorHint& hint = hints[i];
    const std::string name = "colour hint " + std::to_string(i);
    if (!(hint.x_px >= 0.0 && hint.x_px < luminance.width && hint.y_px >= 0.0 &&
          hint.y_px < luminance.height)) {
      throw InvalidArgument(name + " at (" + std::to_string(hint.x_px) + ", " +
                            std::to_string(hint.y_px) + ") lies outside of the key view of " +
                            std::to_string(luminance.width) + "x" +
                            std::to_string(luminance.height) + " px");
    }
    if (!(hint.radius_px >= 0.0) || !std::isfinite(hint.radius_px)) {
      throw InvalidArgument(name + " has the radius " + std::to_string(hint.radius_px) +
                            " px, it must be >= 0");
    }
    if (!(std::abs(hint.a) <= 128.0) || !(std::abs(hint.b) <= 128.0)) {
      throw InvalidArgument(name + " has a colour outside of -128..128 Lab units");
    }
  }
}

}  // namespace

void HintOptions::Validate() const {
  CheckRange("sigma", sigma, 1e-3, 1e3);
  CheckRange("max_side_px", max_side_px, 64, 8192);
  CheckRange("tolerance", tolerance, 1e-12, 0.1);
  CheckRange("max_iterations", max_iterations, 1, 1000000);
}

HintSolution KeyColorFromStrokes(const Image& luminance,
                                 const Image& strokes,
                                 const HintOptions& options,
                                 ProgressObserver& progress,
                                 const CancellationToken& cancel) {
  options.Validate();
  CheckLuminance(luminance);
  if (strokes.width != luminance.width || strokes.height != luminance.height) {
    throw InvalidArgument("the strokes picture is " + std::to_string(strokes.width) + "x" +
                          std::to_string(strokes.height) + " px, the key view " +
                          std::to_string(luminance.width) + "x" + std::to_string(luminance.height));
  }
  if (strokes.channels != 3 && strokes.channels != 4) {
    throw InvalidArgument("the strokes picture has " + std::to_string(strokes.channels) +
                          " channels, it must have 3 (RGB) or 4 (RGBA)");
  }
  const Image small = FitWithin(luminance, options.max_side_px);
  const HintMap map = MapFromStrokes(strokes, small.width, small.height);
  const bool any = std::any_of(map.coverage.data.begin(), map.coverage.data.end(), [](float value) {
    return value >= kLeastCoverage;
  });
  if (!any) {
    throw InvalidArgument(
        strokes.channels == 4
            ? "the strokes picture hints no pixel (nowhere is alpha above 0.5)"
            : "the strokes picture hints no pixel (nowhere does chroma exceed 6 Lab units)");
  }
  return Solve(luminance, small, map, options, progress, cancel);
}

HintSolution KeyColorFromHints(const Image& luminance,
                               const std::vector<ColorHint>& hints,
                               const HintOptions& options,
                               ProgressObserver& progress,
                               const CancellationToken& cancel) {
  options.Validate();
  CheckLuminance(luminance);
  CheckHints(hints, luminance);
  const Image small = FitWithin(luminance, options.max_side_px);
  const double scale = static_cast<double>(small.width) / luminance.width;
  return Solve(luminance,
               small,
               MapFromHints(hints, scale, small.width, small.height),
               options,
               progress,
               cancel);
}

}  // namespace color3d
