// Estimated error of the colours against seconds since the start of the run, over all stages. Pure
// functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/report/curves.h"
#include "core/report/plot.h"

namespace color3d {

// Stage that ran, in the order of the pipeline.
struct RanStage {
  std::string kind;
  double seconds = 0.0;  // of computing
};

struct RunPoint {
  double seconds = 0.0;  // of computing since the start of the run
  std::string stage;     // that ran then
  double error = 0.0;    // estimated CIEDE2000 of chroma
};

struct RunCurve {
  std::vector<RunPoint> points;      // by seconds; at least one at the end of each stage
  std::vector<RunPoint> chroma;      // of the chroma solver on held-out predicted colours
  std::optional<double> true_error;  // of held-out views at the end of the run; nullopt: no truth
};

// Estimates by EstimatedError (core/catalogue/error_model.h). `points` is empty if no colorizer was
// trained.
RunCurve EstimateRunCurve(const std::vector<RanStage>& stages,
                          const std::vector<CurvePoint>& curves);

// Points of curves.csv: stage "whole_run", errors "estimated_delta_e00", "heldout_delta_e00" and
// "delta_e00_chroma".
std::vector<CurvePoint> RunCurvePoints(const RunCurve& curve);

// One line for each stage, so that the stages are bands of colour, and one each for the chroma
// solver and the true error.
Plot RunCurvePlot(const RunCurve& curve);

}  // namespace color3d
