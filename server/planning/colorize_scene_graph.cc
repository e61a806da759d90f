#include "server/planning/colorize_scene_graph.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "core/catalogue/captures.h"
#include "core/catalogue/stages.h"
#include "server/base/service_error.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/presets.h"

namespace color3d {
namespace {

using v1::ColorizeSceneSpec;
using v1::JobSpec;

// A stage whose job may be an input of a colorize_scene job, and whether its options request the
// stage as well.
struct GivenStage {
  const char* kind;
  bool asked_for;
};

void CheckGivenJob(const JobRecord& job, bool asked_for, const std::string& missing) {
  if (asked_for) {
    throw InvalidArgument(
        "the input {} is the {} job, but {} has options for that stage too; leave one of them out",
        job.name,
        job.kind,
        kind::kColorizeScene);
  }
  if (!missing.empty()) {
    throw InvalidArgument(
        "the input {} ({}) comes without its own input, the {} job; add it to spec.inputs",
        job.name,
        job.kind,
        missing);
  }
  if (job.state != JobState::kSucceeded) {
    throw ServiceError(ErrorReason::kInputMissing,
                       "the input {} is {}, it must have succeeded",
                       job.name,
                       JobStateName(job.state));
  }
}

// Checks that the inputs are allowed and that the options do not request the same stages.
void CheckGiven(const std::map<std::string, JobRecord>& given, const ColorizeSceneSpec& options) {
  const bool colors_key_view = options.has_key_color() ||
                               options.colorize_key_view().has_source() ||
                               options.colorize_key_view().has_hint_sigma();
  const GivenStage stages[] = {
      {kind::kImportScene, options.has_import_scene()},
      {kind::kSelectKeyView, !options.key_view().empty() || options.has_select_key_view()},
      {kind::kColorizeKeyView, colors_key_view}};
  std::string missing;  // the first stage before a given one that is not given
  for (const auto& [kind, asked_for] : stages) {
    const auto found = given.find(kind);
    if (found != given.end()) {
      CheckGivenJob(found->second, asked_for, missing);
    } else if (missing.empty()) {
      missing = kind;
    }
  }
  for (const auto& [kind, job] : given) {
    if (std::ranges::find(stages, kind, &GivenStage::kind) != std::end(stages)) continue;
    throw InvalidArgument("the input {} is a {} job; {} takes {}, {} and {} jobs only",
                          job.name,
                          job.kind,
                          kind::kColorizeScene,
                          kind::kImportScene,
                          kind::kSelectKeyView,
                          kind::kColorizeKeyView);
  }
  if (!given.contains(kind::kColorizeKeyView) && !colors_key_view) {
    throw InvalidArgument("key_color is required, because no input is a {} job",
                          kind::kColorizeKeyView);
  }
}

// Copies options of the scene that belong to the stage but stand outside the field of its name.
void CopySceneOptions(const ColorizeSceneSpec& options, JobSpec* spec) {
  switch (spec->stage_case()) {
    case JobSpec::kSelectKeyView:
      if (options.key_view().empty()) return;
      spec->mutable_select_key_view()->set_strategy(v1::SelectKeyViewSpec::STRATEGY_MANUAL);
      spec->mutable_select_key_view()->set_view(options.key_view());
      return;
    case JobSpec::kColorizeKeyView:
      if (!options.has_key_color()) return;
      *spec->mutable_colorize_key_view()->mutable_source() = options.key_color();
      return;
    case JobSpec::kGenerateAugmentations:
      spec->mutable_generate_augmentations()->set_samples(
          options.has_generate_augmentations() ? SamplesOf(options.generate_augmentations()) : 0);
      return;
    case JobSpec::kColorizeViews:
      // A colorizer needs the encoder that it was trained with.
      spec->mutable_colorize_views()->set_encoder(options.personalize().encoder());
      return;
    case JobSpec::kCorrectColors:
      spec->mutable_correct_colors()->set_encoder(options.personalize().encoder());
      return;
    case JobSpec::kExport:
      spec->mutable_export_()->set_ply(true);
      return;
    case JobSpec::kEvaluate:
      *spec->mutable_evaluate()->mutable_truth() = options.truth();
      *spec->mutable_evaluate()->mutable_training_truth() = options.training_truth();
      return;
    default:
      return;
  }
}

// Reason for carrying no colour; empty if colour is carried. `scene`: `given` over its preset.
std::string NoCarryReason(const ColorizeSceneSpec& given, const ColorizeSceneSpec& scene) {
  if (!scene.carry_color().skip()) return "";
  return given.carry_color().has_skip() ? "carry_color.skip is set"
                                        : "the preset carries no colour";
}

bool TrainsJointly(const ColorizeSceneSpec& scene) {
  return scene.carry_color().skip() && scene.carry_color().train_jointly();
}

struct MethodInputs {
  bool colorizer = false;  // of the scene
  bool carried = false;    // colours, also for training the colorizer
};

MethodInputs InputsOf(v1::ColorizeViewsSpec::Method method) {
  switch (method) {
    case v1::ColorizeViewsSpec::METHOD_CARRIED:
      return {.carried = true};
    case v1::ColorizeViewsSpec::METHOD_AUTOMATIC:
    case v1::ColorizeViewsSpec::METHOD_FLOW:
    case v1::ColorizeViewsSpec::METHOD_GRAY:
      return {};
    default:
      return {.colorizer = true, .carried = true};
  }
}

const std::string& NameOf(v1::ColorizeViewsSpec::Method method) {
  return v1::ColorizeViewsSpec::Method_Name(method);
}

// Reason why the method of colorize_views leaves out a stage before it; empty if it does not.
// Additional key views are carried in any case; corrections need the colorizer.
std::string UnusedReason(const std::string& kind,
                         const ColorizeSceneSpec& given,
                         const ColorizeSceneSpec& scene) {
  const auto method = scene.colorize_views().method();
  const MethodInputs inputs = InputsOf(method);
  const bool corrects = given.has_correct_colors() || !scene.correct_colors().corrections().empty();
  const bool trains = kind == kind::kPersonalize || kind == kind::kGenerateAugmentations;
  if (trains && !inputs.colorizer && !corrects) {
    return "colorize_views.method is " + NameOf(method) + ", which uses no colorizer";
  }
  if (kind == kind::kCarryColor && !inputs.carried && !corrects &&
      scene.carry_color().further_key_views().empty()) {
    return "colorize_views.method is " + NameOf(method) + ", which uses no carried colours";
  }
  return "";
}

void CheckMethod(const ColorizeSceneSpec& scene) {
  const auto method = scene.colorize_views().method();
  const std::string is = "colorize_views.method is " + NameOf(method);
  if (method == v1::ColorizeViewsSpec::METHOD_CARRIED && scene.carry_color().skip()) {
    throw InvalidArgument("{}, but no colours are carried; set carry_color.skip to false", is);
  }
  const v1::PersonalizeSpec& training = scene.personalize();
  if (method == v1::ColorizeViewsSpec::METHOD_NEAREST_NEIGHBORS &&
      (training.recipe() == v1::PersonalizeSpec::RECIPE_PAPER ||
       (training.has_neighbors() && !training.neighbors()))) {
    throw InvalidArgument(
        "{}, but the colorizer has no neighbours; set personalize.recipe to RECIPE_COLOR3D and "
        "personalize.neighbors to true",
        is);
  }
  if (method == v1::ColorizeViewsSpec::METHOD_DECODER && training.iterations() == 0) {
    throw InvalidArgument(
        "{}, but personalize.iterations is 0, so that the decoder is not trained; give some", is);
  }
}

// Reason for generating no pictures; empty if they are generated. Files in augment/ are used on
// request only.
std::string NoAugmentationsReason(const ColorizeSceneSpec& scene, const SceneFacts& facts) {
  const auto& spec = scene.generate_augmentations();
  if (spec.files() && facts.augment_files == 0) {
    throw InvalidArgument(
        "generate_augmentations.files is true, but the scene has no pictures in augment/; add some "
        "or leave it out");
  }
  if (spec.files()) return "";
  const std::string unused =
      facts.augment_files > 0 ? "; augment/ has " + std::to_string(facts.augment_files) +
                                    " files, which are used if generate_augmentations.files is true"
                              : "";
  if (!scene.has_generate_augmentations()) {
    return "the preset trains on the key view alone" + unused;
  }
  // Options request the stage unless the number of samples is 0.
  return SamplesOf(spec) == 0 ? "no samples are requested" + unused : "";
}

// Reason why a stage has nothing to do for the scene; empty if it has, or if only import finds out.
std::string IdleReason(const std::string& kind,
                       const SceneFacts& facts,
                       const ColorizeSceneSpec& scene) {
  return std::string(WhyNothingToDo(KindBeforeImport(facts, scene.import_scene()), kind));
}

// `scene`: as in BuildColorizeSceneGraph.
void CheckCorrections(const ColorizeSceneSpec& scene, const SceneFacts& facts, bool is_film) {
  const bool has_poses = is_film && EstimatesPoses(facts, scene.import_scene());
  for (const v1::FurtherKeyView& correction : scene.correct_colors().corrections()) {
    const bool has_range = HasRange(correction);
    if (is_film && !has_range) {
      throw InvalidArgument(
          "corrections of places need a reconstructed scene; for a film colour additional key "
          "views instead (carry_color.further_key_views), or give each correction a range of time "
          "(begin_s, end_s)");
    }
    if (has_range && (!is_film || has_poses)) {
      throw InvalidArgument(
          "the key view {} has a range of time (begin_s, end_s), which is for films without poses; "
          "leave the range out{}",
          correction.view(),
          has_poses ? ", or import the film without import_scene.film_poses" : "");
    }
  }
}

}  // namespace

void BuildColorizeSceneGraph(const JobSpec& submitted,
                             const ColorizeSceneSpec& scene,
                             const SceneFacts& facts,
                             GraphBuilder* builder) {
  const ColorizeSceneSpec& given = submitted.colorize_scene();
  if (scene.select_key_view().count() > 1) {
    throw InvalidArgument(
        "select_key_view.count is {}, but this job selects one key view; select several by a {} "
        "job, and name all but the first in carry_color.further_key_views",
        scene.select_key_view().count(),
        kind::kSelectKeyView);
  }
  if (submitted.inputs_size() > 0) CheckGiven(builder->given(), given);
  const bool is_film = !InfoOf(InfoOf(facts.layout).kind).is_reconstructed;
  CheckCorrections(scene, facts, is_film);
  CheckMethod(scene);
  for (const Stage& stage : StageCatalogue()) {
    const std::string kind = stage.kind;
    if (kind == kind::kColorizeScene || kind == kind::kPersonalizeScenes) continue;
    JobSpec spec = builder->StageSpec(kind);
    CopySceneOptions(scene, &spec);
    if (kind == kind::kPersonalize && is_film) {
      *spec.mutable_personalize() = scene.personalize();
      TrainAtFrameSize(scene.max_side_px(), spec.mutable_personalize());
    }
    if (kind == kind::kPersonalize &&
        scene.colorize_views().method() == v1::ColorizeViewsSpec::METHOD_DECODER) {
      spec.mutable_personalize()->set_min_decoder_share(0.0);
    }
    std::string skip_reason;
    if (kind == kind::kCarryColor) {
      skip_reason = NoCarryReason(given, scene);
      if (TrainsJointly(scene)) {
        builder->AddJointKeyViews(scene.carry_color().further_key_views());
      }
    }
    if (kind == kind::kCorrectColors && !given.has_correct_colors() &&
        scene.correct_colors().corrections().empty()) {
      skip_reason = "no corrections were given";
    }
    if (kind == kind::kGenerateAugmentations) skip_reason = NoAugmentationsReason(scene, facts);
    if (skip_reason.empty()) skip_reason = UnusedReason(kind, given, scene);
    if (skip_reason.empty()) skip_reason = IdleReason(kind, facts, scene);
    builder->Add(std::move(spec), skip_reason);
  }
  builder->AddParent();
}

}  // namespace color3d
