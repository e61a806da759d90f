#include "server/planning/planner.h"

#include <optional>
#include <string>
#include <utility>

#include "core/catalogue/stages.h"
#include "server/planning/asked_formats.h"
#include "server/planning/colorize_scene_graph.h"
#include "server/planning/graph_builder.h"
#include "server/planning/job_spec.h"
#include "server/planning/presets.h"
#include "server/planning/spec_check.h"
#include "server/planning/time_budget.h"

namespace color3d {
namespace {

// Sets the encoder of a colorize_views or correct_colors job, if it is unset, to that of the input
// personalize job.
void SetEncoderOfColorizer(const GraphBuilder& builder, v1::JobSpec* spec) {
  std::string* encoder = nullptr;
  if (spec->has_colorize_views()) encoder = spec->mutable_colorize_views()->mutable_encoder();
  if (spec->has_correct_colors()) encoder = spec->mutable_correct_colors()->mutable_encoder();
  if (encoder == nullptr || !encoder->empty()) return;
  const auto given = builder.given().find(kind::kPersonalize);
  if (given == builder.given().end()) return;
  const v1::JobSpec personalize = ParseSpec(given->second.spec, given->second.name);
  *encoder = personalize.personalize().encoder();
}

void BuildStageGraph(const v1::JobSpec& submitted, GraphBuilder* builder) {
  v1::JobSpec spec = submitted;
  if (spec.has_generate_augmentations()) {
    spec.mutable_generate_augmentations()->set_samples(SamplesOf(spec.generate_augmentations()));
  }
  SetEncoderOfColorizer(*builder, &spec);
  std::string skip_reason;
  if (spec.has_export_() && AskedFormats(spec.export_()).empty()) {
    skip_reason = "there is nothing to export; ask for " + ExportFormatNames();
  }
  builder->Add(std::move(spec), skip_reason);
}

// The submitted options over their preset, with the options of the import among the inputs: poses,
// range and stride of a film are fixed by it.
v1::ColorizeSceneSpec SceneOf(const v1::JobSpec& submitted, const std::vector<JobRecord>& inputs) {
  v1::ColorizeSceneSpec scene = WithPreset(submitted.colorize_scene());
  for (const JobRecord& input : inputs) {
    if (!submitted.has_colorize_scene() || input.kind != kind::kImportScene) continue;
    *scene.mutable_import_scene() = ParseSpec(input.spec, input.name).import_scene();
  }
  return scene;
}

}  // namespace

NewGraph PlanJob(v1::JobSpec spec, const std::vector<JobRecord>& inputs, const SceneFacts& facts) {
  CheckSpec(spec);
  if (spec.has_personalize_scenes()) {
    throw Error(ErrorCode::kInternal, "{} is planned by PlanPersonalizeScenes", KindOf(spec));
  }
  // A fixed default, so that equal submissions have equal stage keys.
  if (spec.seed() == 0) spec.set_seed(1);
  const v1::ColorizeSceneSpec scene = SceneOf(spec, inputs);
  if (spec.has_colorize_scene()) CheckJointTraining(scene);
  std::optional<TimeBudget> time_budget;
  if (scene.time_budget_seconds() > 0.0) {
    time_budget = DivideTimeBudget(scene.time_budget_seconds(), facts, scene.import_scene());
  }
  GraphBuilder builder(spec, inputs, [&](v1::JobSpec* stage) {
    FillStage(scene, stage);
    if (time_budget) ApplyTimeBudget(*time_budget, stage);
  });
  if (spec.has_colorize_scene()) {
    BuildColorizeSceneGraph(spec, scene, facts, &builder);
  } else {
    BuildStageGraph(spec, &builder);
  }
  return builder.Take();
}

}  // namespace color3d
