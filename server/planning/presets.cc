#include "server/planning/presets.h"

namespace color3d {
namespace {

// PersonalizeSpec.least_improvement (tests/bench/colorizer/colorizer_choices.md). Short schedules
// gain nothing by stopping early; the paper's always runs to its end.
constexpr double kLeastImprovementFast = 0.0;
constexpr double kLeastImprovementBest = 0.1;
constexpr double kLeastImprovementPaper = 0.0;

}  // namespace

PresetValues ValuesOf(v1::Preset preset) {
  PresetValues values;
  switch (preset) {
    case v1::PRESET_BEST:
      values.max_side_px = 800;
      values.personalize_iterations = 1200;
      values.least_improvement = kLeastImprovementBest;
      values.geometry_iterations = 5000;
      values.max_gaussians = 120'000;
      values.chroma_iterations = 800;
      break;
    case v1::PRESET_PAPER:
      values.max_side_px = 1600;
      values.strategy = v1::SelectKeyViewSpec::STRATEGY_ENTROPY;
      values.recipe = v1::PersonalizeSpec::RECIPE_PAPER;
      values.personalize_iterations = 4000;
      values.least_improvement = kLeastImprovementPaper;
      values.augmentation_samples = 8;
      values.geometry_recipe = v1::ReconstructGeometrySpec::RECIPE_PAPER;
      values.geometry_iterations = 15'000;
      values.max_gaussians = 2'000'000;
      values.sh_degree = 3;
      values.densify_gradient = 2e-4;
      values.chroma_solver = v1::SolveChromaSpec::SOLVER_ADAM;
      values.chroma_iterations = 15'000;
      break;
    default:
      values.max_side_px = 500;
      values.personalize_iterations = 300;
      values.least_improvement = kLeastImprovementFast;
      values.geometry_iterations = 1500;
      values.max_gaussians = 40'000;
      values.chroma_iterations = 300;
      break;
  }
  return values;
}

}  // namespace color3d
