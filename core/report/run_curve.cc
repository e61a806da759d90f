#include "core/report/run_curve.h"

#include <algorithm>
#include <utility>

#include "core/catalogue/error_model.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

constexpr char kWholeRun[] = "whole_run";
constexpr char kEstimate[] = "estimated_delta_e00";

std::vector<CurvePoint> PointsOf(const std::vector<CurvePoint>& curves,
                                 const std::string& stage,
                                 const std::string& error_name) {
  std::vector<CurvePoint> points;
  for (const CurvePoint& p : curves) {
    if (p.stage == stage && p.error_name == error_name) points.push_back(p);
  }
  return points;
}

std::optional<double> LastValue(const std::vector<CurvePoint>& points) {
  return points.empty() ? std::nullopt : std::optional(points.back().value);
}

std::string InWords(std::string kind) {
  std::replace(kind.begin(), kind.end(), '_', ' ');
  return kind;
}

}  // namespace

RunCurve EstimateRunCurve(const std::vector<RanStage>& stages,
                          const std::vector<CurvePoint>& curves) {
  const auto validation = PointsOf(curves, kind::kPersonalize, kValidationCurve);
  if (validation.empty()) return {};
  const double coverage =
      LastValue(PointsOf(curves, kind::kCarryColor, kCoverageCurve)).value_or(0.0);
  RunCurve curve;
  double start = 0.0;
  RunState run;
  run.uncovered_error = validation.front().value;  // of a colorizer that has learnt nothing
  const auto estimate = [&] { return EstimatedError(run); };
  for (const RanStage& stage : stages) {
    curve.points.push_back({start, stage.kind, estimate()});
    if (stage.kind == kind::kCarryColor) run.carried_share = coverage;
    if (stage.kind == kind::kPersonalize) {
      for (const CurvePoint& p : validation) {
        run.uncovered_error = p.value;
        curve.points.push_back(
            {start + std::min(p.seconds, stage.seconds), stage.kind, estimate()});
      }
    }
    if (stage.kind == kind::kSolveChroma) {
      for (const CurvePoint& p : PointsOf(curves, kind::kSolveChroma, kHeldOutChromaCurve)) {
        curve.chroma.push_back({start + std::min(p.seconds, stage.seconds), stage.kind, p.value});
      }
    }
    if (stage.kind == kind::kSolveChroma) {
      run.disagreement = LastValue(PointsOf(curves, kind::kSolveChroma, kDisagreementCurve));
    }
    start += stage.seconds;
    curve.points.push_back({start, stage.kind, estimate()});
  }
  curve.true_error = LastValue(PointsOf(curves, kind::kEvaluate, kScoreCurve));
  return curve;
}

std::vector<CurvePoint> RunCurvePoints(const RunCurve& curve) {
  std::vector<CurvePoint> points;
  for (const RunPoint& p : curve.points) {
    points.push_back({kWholeRun, p.seconds, 0, kEstimate, p.error});
  }
  for (const RunPoint& p : curve.chroma) {
    points.push_back({kWholeRun, p.seconds, 0, kHeldOutChromaCurve, p.error});
  }
  if (!curve.points.empty() && curve.true_error) {
    points.push_back({kWholeRun, curve.points.back().seconds, 0, kScoreCurve, *curve.true_error});
  }
  return points;
}

Plot RunCurvePlot(const RunCurve& curve) {
  Plot plot;
  plot.title = "estimated error of the colours";
  for (const RunPoint& p : curve.points) {
    const std::string name = InWords(p.stage);
    if (plot.series.empty() || plot.series.back().name != name) plot.series.push_back({name, {}});
    plot.series.back().points.push_back({p.stage, p.seconds, 0, kEstimate, p.error});
  }
  // Stages that took no visible time would only lengthen the legend.
  const double end = curve.points.empty() ? 0.0 : curve.points.back().seconds;
  std::erase_if(plot.series, [&](const PlotSeries& series) {
    return series.points.back().seconds - series.points.front().seconds < 0.02 * end;
  });
  if (!plot.series.empty() && !curve.chroma.empty()) {
    PlotSeries chroma{"chroma, held out", {}};
    for (const RunPoint& p : curve.chroma) {
      chroma.points.push_back({p.stage, p.seconds, 0, kHeldOutChromaCurve, p.error});
    }
    plot.series.push_back(std::move(chroma));
  }
  if (!plot.series.empty() && curve.true_error) {
    plot.series.push_back({"truth", {{kWholeRun, end, 0, kScoreCurve, *curve.true_error}}});
  }
  return plot;
}

}  // namespace color3d
