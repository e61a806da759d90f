#include "server/planning/planner.h"

#include <optional>
#include <utility>

#include "core/catalogue/stages.h"
#include "server/planning/colorize_scene_graph.h"
#include "server/planning/graph_builder.h"
#include "server/planning/job_spec.h"
#include "server/planning/presets.h"
#include "server/planning/spec_check.h"
#include "server/planning/time_budget.h"

namespace color3d {
namespace {

// Writes the preset's values into the unset fields of a stage's options.
void ApplyPreset(const PresetValues& preset, int max_side_px, v1::JobSpec* spec) {
  if (spec->has_select_key_view()) {
    auto* s = spec->mutable_select_key_view();
    if (s->strategy() == v1::SelectKeyViewSpec::STRATEGY_UNSPECIFIED) {
      s->set_strategy(preset.strategy);
    }
  } else if (spec->has_generate_augmentations()) {
    auto* s = spec->mutable_generate_augmentations();
    if (!s->has_samples()) s->set_samples(preset.augmentation_samples);
  } else if (spec->has_personalize()) {
    auto* s = spec->mutable_personalize();
    if (s->recipe() == v1::PersonalizeSpec::RECIPE_UNSPECIFIED) s->set_recipe(preset.recipe);
    if (!s->has_iterations()) s->set_iterations(preset.personalize_iterations);
    if (!s->has_least_improvement()) s->set_least_improvement(preset.least_improvement);
  } else if (spec->has_colorize_views()) {
    auto* s = spec->mutable_colorize_views();
    if (!s->has_max_side_px()) s->set_max_side_px(max_side_px);
  } else if (spec->has_carry_color()) {
    auto* s = spec->mutable_carry_color();
    if (!s->has_max_side_px()) s->set_max_side_px(max_side_px);
  } else if (spec->has_reconstruct_geometry()) {
    auto* s = spec->mutable_reconstruct_geometry();
    if (!s->has_iterations()) s->set_iterations(preset.geometry_iterations);
    if (!s->has_max_side_px()) s->set_max_side_px(max_side_px);
    if (!s->has_max_gaussians()) s->set_max_gaussians(preset.max_gaussians);
    if (!s->has_sh_degree()) s->set_sh_degree(preset.sh_degree);
    if (!s->has_densify_gradient()) s->set_densify_gradient(preset.densify_gradient);
    if (s->recipe() == v1::ReconstructGeometrySpec::RECIPE_UNSPECIFIED) {
      s->set_recipe(preset.geometry_recipe);
    }
  } else if (spec->has_solve_chroma()) {
    auto* s = spec->mutable_solve_chroma();
    if (!s->has_iterations()) s->set_iterations(preset.chroma_iterations);
    if (s->solver() == v1::SolveChromaSpec::SOLVER_UNSPECIFIED) {
      s->set_solver(preset.chroma_solver);
    }
  } else if (spec->has_render()) {
    auto* s = spec->mutable_render();
    if (!s->has_max_side_px()) s->set_max_side_px(max_side_px);
  }
}

// A colorize_views job that names no encoder works with that of the given personalize job.
void TakeEncoderOfColorizer(const GraphBuilder& builder, v1::JobSpec* spec) {
  if (!spec->has_colorize_views() || !spec->colorize_views().encoder().empty()) return;
  const auto given = builder.given().find(kind::kPersonalize);
  if (given == builder.given().end()) return;
  const v1::JobSpec personalize = ParseSpec(given->second.spec, given->second.name);
  spec->mutable_colorize_views()->set_encoder(personalize.personalize().encoder());
}

void BuildStageGraph(const v1::JobSpec& submitted, GraphBuilder* builder) {
  v1::JobSpec spec = submitted;
  if (spec.seed() == 0) spec.set_seed(1);
  if (spec.has_generate_augmentations() && !spec.generate_augmentations().has_samples()) {
    spec.mutable_generate_augmentations()->set_samples(kDefaultSamples);
  }
  TakeEncoderOfColorizer(*builder, &spec);
  const bool nothing_to_do = spec.has_export_() && spec.export_().has_ply() &&
                             !spec.export_().ply() && !spec.export_().splat();
  builder->Add(std::move(spec),
               nothing_to_do
                   ? "export.ply is false and no splat is asked for: there is nothing to export"
                   : "");
}

}  // namespace

NewGraph PlanJob(const v1::JobSpec& spec,
                 const std::vector<JobRecord>& inputs,
                 const SceneFacts& facts) {
  CheckSpec(spec);
  if (spec.has_personalize_scenes()) {
    throw Error(ErrorCode::kInternal, "{} is planned by PlanPersonalizeScenes", KindOf(spec));
  }
  const v1::ColorizeSceneSpec& scene = spec.colorize_scene();
  const PresetValues preset = ValuesOf(scene.preset());
  const int max_side_px = scene.has_max_side_px() ? scene.max_side_px() : preset.max_side_px;
  std::optional<TimeBudget> time_budget;
  if (scene.time_budget_seconds() > 0.0) {
    time_budget = DivideTimeBudget(scene.time_budget_seconds(), facts);
  }
  GraphBuilder builder(spec, inputs, [&](v1::JobSpec* stage) {
    ApplyPreset(preset, max_side_px, stage);
    if (time_budget) ApplyTimeBudget(*time_budget, stage);
  });
  if (spec.has_colorize_scene()) {
    BuildColorizeSceneGraph(spec, facts, preset.augmentation_samples, &builder);
  } else {
    BuildStageGraph(spec, &builder);
  }
  return builder.Take();
}

}  // namespace color3d
