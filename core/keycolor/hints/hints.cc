#include "core/keycolor/hints/hints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/grid/edge_weights.h"
#include "core/grid/grid_solver.h"
#include "core/grid/quick_grid.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/image/image_checks.h"
#include "core/keycolor/hints/hint_map.h"

namespace color3d {
namespace {

// For quick answers.
constexpr int kSpreadHalvings = 2;

// Propagates hints over a picture of the same size. Sets all of the solution but hinted_pixels.
HintSolution SolveAtSize(const Image& luminance,
                         HintMap hints,
                         const HintOptions& options,
                         const RunControl& control,
                         QuickGrid* prepared = nullptr) {
  const GridSolveOptions until{options.tolerance, options.max_iterations};
  const auto report = [&](int iteration, double residual) {
    control.progress.OnError(iteration, "relative_residual", residual);
    control.progress.OnProgress(iteration, 0, "spreading the colour hints");
  };
  GridSolution solved;
  if (prepared != nullptr) {
    solved = prepared->Solve(std::move(hints.hinted), nullptr, hints.ab.data, control.cancel);
  } else {
    GridSystem system = SystemOfLuminance(luminance, options.sigma, control.pool);
    system.pinned = std::move(hints.hinted);
    solved = SolveGridSystem(
        std::move(system), hints.ab.data, until, control.pool, report, control.cancel);
  }
  if (!solved.converged && prepared == nullptr) {
    control.progress.OnWarning(fmt::format(
        "colour hints: the solver stopped after {} iterations at a relative residual of {:.3g}",
        solved.iterations,
        solved.relative_residual));
  }
  HintSolution solution;
  solution.iterations = solved.iterations;
  solution.relative_residual = solved.relative_residual;
  solution.ab.width = luminance.width;
  solution.ab.height = luminance.height;
  solution.ab.channels = 2;
  solution.ab.data = std::move(solved.u);
  return solution;
}

HintSolution Solve(const Image& luminance,
                   HintMap hints,
                   const HintOptions& options,
                   const RunControl& control,
                   QuickGrid* prepared = nullptr) {
  const int64_t hinted = std::count(hints.hinted.begin(), hints.hinted.end(), 1);
  HintSolution solution;
  if (std::max(luminance.width, luminance.height) <= options.max_side_px) {
    solution = SolveAtSize(luminance, std::move(hints), options, control, prepared);
  } else {
    const Image small = FitWithin(luminance, options.max_side_px);
    solution = SolveAtSize(small, ReduceHints(hints, small.width, small.height), options, control);
    solution.ab = UpsampleGuided(solution.ab, luminance);
    for (size_t i = 0; i < hints.hinted.size(); ++i) {
      if (!hints.hinted[i]) continue;
      solution.ab.Plane(0)[i] = hints.ab.Plane(0)[i];
      solution.ab.Plane(1)[i] = hints.ab.Plane(1)[i];
    }
  }
  solution.hinted_pixels = hinted;
  return solution;
}

}  // namespace

void HintOptions::Validate() const {
  const RangeCheck check("hint option");
  check("sigma", sigma, 0.1, 50.0);
  check("max_side_px", max_side_px, 64, 16384);
  check("tolerance", tolerance, 1e-6, 0.1);
  check("max_iterations", max_iterations, 1, 1000000);
}

HintSolution KeyColorFromStrokes(const Image& luminance,
                                 const Image& strokes,
                                 const HintOptions& options,
                                 const RunControl& control) {
  options.Validate();
  RequireFiniteLuminance(luminance, "the colouring of the key view");
  if (strokes.width != luminance.width || strokes.height != luminance.height) {
    throw InvalidArgument("the strokes picture is {}x{} px, but the key view {}x{}",
                          strokes.width,
                          strokes.height,
                          luminance.width,
                          luminance.height);
  }
  if (strokes.channels != 3 && strokes.channels != 4) {
    throw InvalidArgument("the strokes picture has {} channels, but must have 3 (RGB) or 4 (RGBA)",
                          strokes.channels);
  }
  HintMap hints = HintsFromStrokes(strokes);
  if (std::find(hints.hinted.begin(), hints.hinted.end(), 1) == hints.hinted.end()) {
    throw InvalidArgument(
        strokes.channels == 4
            ? "the strokes picture has no hint (alpha is nowhere above 0.5)"
            : "the strokes picture has no hint (chroma nowhere exceeds 6 Lab units)");
  }
  return Solve(luminance, std::move(hints), options, control);
}

HintSolution KeyColorFromHints(const Image& luminance,
                               const std::vector<ColorHint>& hints,
                               const HintOptions& options,
                               const RunControl& control,
                               const HintPictures& pictures,
                               QuickGrid* prepared) {
  options.Validate();
  RequireFiniteLuminance(luminance, "the colouring of the key view");
  return Solve(
      luminance,
      DrawHints(
          hints, pictures, luminance.width, luminance.height, control.progress, control.cancel),
      options,
      control,
      prepared);
}

std::shared_ptr<QuickGrid> PrepareHints(const Image& luminance,
                                        const HintOptions& options,
                                        ThreadPool& pool) {
  options.Validate();
  RequireFiniteLuminance(luminance, "the colouring of the key view");
  return std::make_shared<QuickGrid>(SystemOfLuminance(luminance, options.sigma, pool),
                                     kSpreadHalvings,
                                     pool,
                                     CancellationToken());
}

int64_t BytesOf(const QuickGrid& prepared) { return prepared.bytes(); }

std::vector<ColorHint> ScaleHints(std::vector<ColorHint> hints, double x, double y) {
  // Thinner ones would cover a pixel here and there.
  constexpr double kLeastRadiusPx = 0.75;
  const double mean = std::sqrt(x * y);
  for (ColorHint& hint : hints) {
    hint.x_px *= x;
    hint.y_px *= y;
    if (mean < 1.0) {
      hint.radius_px = std::max(std::min(kLeastRadiusPx, hint.radius_px), hint.radius_px * mean);
    } else {
      hint.radius_px *= mean;
    }
    for (auto& point : hint.points_px) point = {point[0] * x, point[1] * y};
  }
  return hints;
}

}  // namespace color3d
