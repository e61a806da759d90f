#include "core/stage/carry/carry_results.h"

#include <fmt/format.h>

#include "core/carry/confidence.h"
#include "core/catalogue/error_model.h"
#include "core/stage/formats/carry_facts.h"

namespace color3d {
namespace {

constexpr double kSmallCoverage = 0.01;  // below, the user is warned

// Mean over the views that are not key views.
double MeanCoverage(const CarryInputs& inputs, const std::vector<double>& coverage) {
  double sum = 0.0;
  for (size_t i = 0; i < coverage.size(); ++i) {
    if (!inputs.IsKeyView(static_cast<int>(i))) sum += coverage[i];
  }
  const size_t others = coverage.size() - inputs.key_views.size();
  return others > 0 ? sum / static_cast<double>(others) : 1.0;
}

}  // namespace

double CoveredShare(const CarriedColor& color) { return Coverage(color, kCoveredConfidence); }

double WriteCoverage(const CarryInputs& inputs,
                     const std::vector<double>& coverage,
                     StageContext& context) {
  const std::vector<View>& views = inputs.scene.views;
  CarryFacts facts;
  for (const int view : inputs.key_views) facts.key_views.push_back(views[view].name);
  const double mean = MeanCoverage(inputs, coverage);
  facts.coverage = mean;
  for (size_t i = 0; i < coverage.size(); ++i) facts.view_coverage[views[i].name] = coverage[i];
  context.progress().OnError(0, kCoverageCurve, mean);
  WriteCarryFacts(facts, context);
  return mean;
}

void WarnOfSmallCoverage(double mean, StageContext& context) {
  if (mean >= kSmallCoverage) return;
  context.Warn(
      "the key view shows only {:.1f} % of what the other views show; their colours "
      "are inferred from similarity. Colour a second key view, or choose another one",
      100.0 * mean);
}

}  // namespace color3d
