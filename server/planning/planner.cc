#include "server/planning/planner.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <map>
#include <optional>
#include <utility>

#include "server/planning/presets.h"
#include "server/planning/spec_check.h"
#include "server/planning/spec_names.h"
#include "server/service_error.h"

namespace color3d {
namespace {

std::string Serialize(const google::protobuf::Message& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  message.SerializeToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

// The kinds whose artifacts each kind reads, and what they are called when one is missing.
struct Need {
  const char* provider;
  const char* artifact;
};
constexpr int kDefaultSamples = 8;  // of generate_augmentations, where somebody asks for it
constexpr Need kScene = {"import_scene", "scene.json"};
constexpr Need kKeyView = {"select_key_view", "key_view.json"};
constexpr Need kKeyColor = {"colorize_key_view", "key_color.png"};
constexpr Need kColorizer = {"personalize", "colorizer.c3c"};
constexpr Need kViewsAb = {"colorize_views", "views_ab/*"};
constexpr Need kGeometry = {"reconstruct_geometry", "geometry.c3g"};
constexpr Need kModel = {"solve_chroma", "model.c3g"};

const std::vector<Need>& NeedsOf(const std::string& kind) {
  static const std::map<std::string, std::vector<Need>> needs = {
      {"import_scene", {}},
      {"select_key_view", {kScene}},
      {"colorize_key_view", {kScene, kKeyView}},
      {"generate_augmentations", {kScene, kKeyView, kKeyColor}},
      {"personalize", {kScene, kKeyView, kKeyColor}},
      {"colorize_views", {kScene, kColorizer}},
      {"reconstruct_geometry", {kScene}},
      {"carry_color", {kScene, kKeyView, kKeyColor, kGeometry}},
      {"solve_chroma", {kScene, kKeyView, kKeyColor, kViewsAb, kGeometry}},
      {"export", {kScene, kModel}},
      {"render", {kScene, kModel}},
      {"evaluate", {kScene, kKeyView, kKeyColor, kViewsAb, kModel}},
  };
  return needs.at(kind);
}

// Kinds whose artifacts each kind reads when they are there.
const std::vector<std::string>& WelcomeTo(const std::string& kind) {
  static const std::map<std::string, std::vector<std::string>> welcome = {
      {"generate_augmentations", {"reconstruct_geometry", "carry_color"}},
      {"personalize", {"generate_augmentations", "carry_color"}},
      {"colorize_views", {"carry_color"}},
  };
  static const std::vector<std::string> none;
  const auto found = welcome.find(kind);
  return found == welcome.end() ? none : found->second;
}

// These stages need no decision of the user's, so a job of their own brings what it lacks along.
bool CreatesPrerequisites(const std::string& kind) {
  return kind == "select_key_view" || kind == "reconstruct_geometry" || kind == "colorize_key_view";
}

// Writes a stage's share of the time budget into its options, unless they say otherwise.
void ApplyTimeBudget(const TimeBudget& budget, v1::JobSpec* spec) {
  const auto limit = [](auto* options, double seconds) {
    if (!options->has_time_limit_seconds()) options->set_time_limit_seconds(seconds);
  };
  if (spec->has_personalize()) {
    limit(spec->mutable_personalize(), budget.personalize_seconds);
  } else if (spec->has_reconstruct_geometry()) {
    limit(spec->mutable_reconstruct_geometry(), budget.geometry_seconds);
  } else if (spec->has_solve_chroma()) {
    limit(spec->mutable_solve_chroma(), budget.chroma_seconds);
  }
}

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

// Why a ColorizeScene graph carries no colour; empty when it does.
std::string WhyNothingIsCarried(const v1::ColorizeSceneSpec& options) {
  const v1::CarryColorSpec& carry = options.carry_color();
  if (carry.has_skip()) return carry.skip() ? "carry_color.skip is set" : "";
  if (options.preset() == v1::PRESET_PAPER && carry.further_key_views().empty()) {
    return "the paper's recipe carries no colour through geometry";
  }
  return "";
}

class GraphBuilder {
 public:
  GraphBuilder(const v1::JobSpec& submitted,
               const std::vector<JobRecord>& inputs,
               const SceneFacts& facts);
  NewGraph BuildStage();
  NewGraph BuildColorizeScene();

 private:
  // A fresh spec with the submitted job's scene, seed and cache policy.
  v1::JobSpec Common() const;
  v1::JobSpec DefaultSpec(const std::string& kind) const;
  // Appends the job with edges to the providers of all it needs; earlier jobs of the graph first,
  // then given inputs, then (when allowed) prerequisites made for it.
  void Add(v1::JobSpec spec, const std::string& skip_reason = "");
  void Provide(const Need& need, const std::string& for_kind, NewJob* job);
  // Adds the jobs whose results `kind` reads when they are there.
  void AddWelcome(const std::string& kind, NewJob* job) const;
  // Why a whole scene needs no generated pictures; empty when it does.
  std::string WhyNoAugmentations(const v1::ColorizeSceneSpec& options) const;
  void AddSceneStages(const v1::ColorizeSceneSpec& options);
  // What a colorize_scene job may be given, and that its options do not ask for something else.
  void CheckGiven(const v1::ColorizeSceneSpec& options) const;
  // A colorize_views job that names no encoder works with that of the given personalize job.
  void TakeEncoderOfColorizer(v1::JobSpec* spec) const;

  const v1::JobSpec& submitted_;
  std::string submitted_kind_;
  PresetValues preset_;
  int max_side_px_ = 0;
  int augment_files_ = 0;
  std::optional<TimeBudget> time_budget_;
  std::map<std::string, JobRecord> given_;  // by kind
  std::map<std::string, int> planned_;      // by kind
  NewGraph graph_;
};

GraphBuilder::GraphBuilder(const v1::JobSpec& submitted,
                           const std::vector<JobRecord>& inputs,
                           const SceneFacts& facts)
    : submitted_(submitted), submitted_kind_(KindOf(submitted)) {
  preset_ = ValuesOf(submitted.colorize_scene().preset());
  max_side_px_ = submitted.colorize_scene().has_max_side_px()
                     ? submitted.colorize_scene().max_side_px()
                     : preset_.max_side_px;
  if (submitted.colorize_scene().time_budget_seconds() > 0.0) {
    time_budget_ = DivideTimeBudget(submitted.colorize_scene().time_budget_seconds(), facts);
  }
  augment_files_ = facts.augment_files;
  graph_.scene = submitted.scene();
  for (const JobRecord& input : inputs) {
    if (input.scene != submitted.scene()) {
      throw InvalidArgument("the input " + input.name + " belongs to '" + input.scene +
                            "', the job to '" + submitted.scene() + "'");
    }
    const auto [it, fresh] = given_.emplace(input.kind, input);
    if (!fresh && it->second.name != input.name) {
      throw InvalidArgument("both inputs " + it->second.name + " and " + input.name + " are " +
                            input.kind + " jobs; give one of them");
    }
  }
}

v1::JobSpec GraphBuilder::Common() const {
  v1::JobSpec spec;
  spec.set_scene(submitted_.scene());
  spec.set_seed(submitted_.seed() != 0 ? submitted_.seed() : 1);
  spec.set_skip_cache(submitted_.skip_cache());
  return spec;
}

v1::JobSpec GraphBuilder::DefaultSpec(const std::string& kind) const {
  v1::JobSpec spec = Common();
  if (kind == "import_scene") spec.mutable_import_scene();
  if (kind == "select_key_view") spec.mutable_select_key_view();
  return spec;
}

void GraphBuilder::Provide(const Need& need, const std::string& for_kind, NewJob* job) {
  const auto planned = planned_.find(need.provider);
  if (planned != planned_.end()) {
    job->inputs.push_back(planned->second);
    return;
  }
  const auto given = given_.find(need.provider);
  if (given != given_.end()) {
    const JobRecord& input = given->second;
    if (IsFinished(input.state) && input.state != JobState::kSucceeded) {
      throw ServiceError(ErrorCode::kFailedPrecondition,
                         "INPUT_MISSING",
                         for_kind + " needs " + need.artifact + ", but the input " + input.name +
                             " is " + JobStateName(input.state) + "; retry it first");
    }
    job->input_jobs.push_back(input.name);
    return;
  }
  if (!CreatesPrerequisites(submitted_kind_)) {
    throw ServiceError(ErrorCode::kFailedPrecondition,
                       "INPUT_MISSING",
                       for_kind + " needs " + need.artifact + "; add the " + need.provider +
                           " job of this scene to spec.inputs");
  }
  Add(DefaultSpec(need.provider));
  job->inputs.push_back(planned_.at(need.provider));
}

void GraphBuilder::AddWelcome(const std::string& kind, NewJob* job) const {
  for (const std::string& other : WelcomeTo(kind)) {
    const auto planned = planned_.find(other);
    const auto given = given_.find(other);
    if (planned != planned_.end()) {
      const int index = planned->second;
      if (graph_.jobs[static_cast<size_t>(index)].skip_reason.empty()) job->inputs.push_back(index);
    } else if (given != given_.end() &&
               (!IsFinished(given->second.state) || given->second.state == JobState::kSucceeded)) {
      job->input_jobs.push_back(given->second.name);
    }
  }
}

std::string GraphBuilder::WhyNoAugmentations(const v1::ColorizeSceneSpec& options) const {
  const auto& spec = options.generate_augmentations();
  if (augment_files_ > 0) return "";
  if (options.has_generate_augmentations()) {
    // Whoever writes options wants the stage, unless they say 0.
    return spec.has_samples() && spec.samples() == 0
               ? "no samples are asked for and augment/ holds no files"
               : "";
  }
  return preset_.augmentation_samples > 0
             ? ""
             : "the preset learns from the key view alone, and augment/ holds no files";
}

void GraphBuilder::Add(v1::JobSpec spec, const std::string& skip_reason) {
  NewJob job;
  job.kind = KindOf(spec);
  if (submitted_.has_colorize_scene() && given_.contains(job.kind)) return;
  job.skip_reason = skip_reason;
  for (const Need& need : NeedsOf(job.kind)) Provide(need, job.kind, &job);
  AddWelcome(job.kind, &job);
  ApplyPreset(preset_, max_side_px_, &spec);
  if (time_budget_) ApplyTimeBudget(*time_budget_, &spec);
  job.spec = Serialize(spec);
  for (const FileDigest& digest : SpecBlobs(spec)) job.blobs.push_back(digest.sha256);
  planned_[job.kind] = static_cast<int>(graph_.jobs.size());
  graph_.jobs.push_back(std::move(job));
}

void GraphBuilder::TakeEncoderOfColorizer(v1::JobSpec* spec) const {
  if (!spec->has_colorize_views() || !spec->colorize_views().encoder().empty()) return;
  const auto given = given_.find(kColorizer.provider);
  if (given == given_.end()) return;
  v1::JobSpec personalize;
  if (!personalize.ParseFromString(given->second.spec)) {
    throw Error(ErrorCode::kDataLoss, "the stored spec of " + given->second.name + " is damaged");
  }
  spec->mutable_colorize_views()->set_encoder(personalize.personalize().encoder());
}

NewGraph GraphBuilder::BuildStage() {
  v1::JobSpec spec = submitted_;
  if (spec.seed() == 0) spec.set_seed(1);
  if (spec.has_generate_augmentations() && !spec.generate_augmentations().has_samples()) {
    spec.mutable_generate_augmentations()->set_samples(kDefaultSamples);
  }
  TakeEncoderOfColorizer(&spec);
  const bool nothing_to_do = spec.has_export_() && spec.export_().has_ply() &&
                             !spec.export_().ply() && !spec.export_().splat();
  Add(std::move(spec),
      nothing_to_do ? "export.ply is false and no splat is asked for: there is nothing to export"
                    : "");
  return std::move(graph_);
}

void GraphBuilder::AddSceneStages(const v1::ColorizeSceneSpec& options) {
  v1::JobSpec spec = Common();
  *spec.mutable_import_scene() = options.import_scene();
  Add(spec);

  spec = Common();
  *spec.mutable_select_key_view() = options.select_key_view();
  if (!options.key_view().empty()) {
    spec.mutable_select_key_view()->set_strategy(v1::SelectKeyViewSpec::STRATEGY_MANUAL);
    spec.mutable_select_key_view()->set_view(options.key_view());
  }
  Add(spec);

  spec = Common();
  *spec.mutable_colorize_key_view() = options.colorize_key_view();
  if (options.has_key_color()) {
    *spec.mutable_colorize_key_view()->mutable_source() = options.key_color();
  }
  Add(spec);

  spec = Common();
  *spec.mutable_reconstruct_geometry() = options.reconstruct_geometry();
  Add(spec);

  spec = Common();
  *spec.mutable_carry_color() = options.carry_color();
  Add(spec, WhyNothingIsCarried(options));

  spec = Common();
  *spec.mutable_generate_augmentations() = options.generate_augmentations();
  if (options.has_generate_augmentations() && !options.generate_augmentations().has_samples()) {
    spec.mutable_generate_augmentations()->set_samples(kDefaultSamples);
  }
  Add(spec, WhyNoAugmentations(options));

  spec = Common();
  *spec.mutable_personalize() = options.personalize();
  Add(spec);

  spec = Common();
  // The colorizer runs on the encoder that it was trained with.
  spec.mutable_colorize_views()->set_encoder(options.personalize().encoder());
  Add(spec);

  spec = Common();
  *spec.mutable_solve_chroma() = options.solve_chroma();
  Add(spec);

  spec = Common();
  spec.mutable_export_()->set_ply(true);
  Add(spec);

  spec = Common();
  *spec.mutable_render() = options.render();
  Add(spec);

  spec = Common();
  *spec.mutable_evaluate()->mutable_truth() = options.truth();
  *spec.mutable_evaluate()->mutable_training_truth() = options.training_truth();
  Add(spec);
}

void GraphBuilder::CheckGiven(const v1::ColorizeSceneSpec& options) const {
  const std::pair<const char*, bool> asked_for[] = {
      {"import_scene", options.has_import_scene()},
      {"select_key_view", !options.key_view().empty() || options.has_select_key_view()},
      {"colorize_key_view",
       options.has_key_color() || options.colorize_key_view().has_source() ||
           options.colorize_key_view().has_hint_sigma()}};
  std::string missing;  // the first stage before a given one that is not given
  for (const auto& [kind, asked] : asked_for) {
    const auto given = given_.find(kind);
    if (given == given_.end()) {
      if (missing.empty()) missing = kind;
      continue;
    }
    if (asked) {
      throw InvalidArgument("the input " + given->second.name + " is the " + kind +
                            " job, but colorize_scene has options for that stage too; leave one "
                            "of them out");
    }
    if (!missing.empty()) {
      throw InvalidArgument("the input " + given->second.name + " (" + kind +
                            ") comes without the " + missing +
                            " job that it read; add that to spec.inputs");
    }
    if (given->second.state != JobState::kSucceeded) {
      throw ServiceError(ErrorCode::kFailedPrecondition,
                         "INPUT_MISSING",
                         "the input " + given->second.name + " is " +
                             JobStateName(given->second.state) + ", it must have succeeded");
    }
  }
  for (const auto& [kind, job] : given_) {
    if (kind == "import_scene" || kind == "select_key_view" || kind == "colorize_key_view")
      continue;
    throw InvalidArgument("the input " + job.name + " is a " + kind +
                          " job; colorize_scene takes import_scene, select_key_view and "
                          "colorize_key_view jobs and makes the rest itself");
  }
  if (!given_.contains("colorize_key_view") && !asked_for[2].second) {
    throw InvalidArgument(
        "key_color is required: no input is a colorize_key_view job that would give it");
  }
}

NewGraph GraphBuilder::BuildColorizeScene() {
  if (submitted_.inputs_size() > 0) CheckGiven(submitted_.colorize_scene());
  AddSceneStages(submitted_.colorize_scene());
  NewJob root;
  root.kind = "colorize_scene";
  v1::JobSpec spec = submitted_;
  if (spec.seed() == 0) spec.set_seed(1);
  root.spec = Serialize(spec);
  for (size_t i = 0; i < graph_.jobs.size(); ++i) root.inputs.push_back(static_cast<int>(i));
  for (const auto& [kind, job] : given_) root.input_jobs.push_back(job.name);
  for (const FileDigest& digest : SpecBlobs(spec)) root.blobs.push_back(digest.sha256);
  graph_.jobs.push_back(std::move(root));
  return std::move(graph_);
}

}  // namespace

NewGraph PlanJob(const v1::JobSpec& spec,
                 const std::vector<JobRecord>& inputs,
                 const SceneFacts& facts) {
  CheckSpec(spec);
  if (spec.has_personalize_scenes()) {
    throw Error(ErrorCode::kInternal, "personalize_scenes is planned by PlanPersonalizeScenes");
  }
  GraphBuilder builder(spec, inputs, facts);
  return spec.has_colorize_scene() ? builder.BuildColorizeScene() : builder.BuildStage();
}

StageKeyPart KeyPartOf(v1::JobSpec spec) {
  StageKeyPart part;
  if (spec.has_colorize_scene() || spec.has_personalize_scenes()) return part;
  const std::string kind = KindOf(spec);
  // Where the work happens is no part of what it is: equal scenes give equal results.
  spec.clear_scene();
  spec.clear_inputs();
  spec.clear_skip_cache();
  part.bytes = kind + '\n' + Serialize(spec);
  const SpecNames names = NamesIn(spec);
  for (const NameUse& use : names.models) part.models.push_back(use.name);
  for (const NameUse& use : names.backends) part.backends.push_back(use.name);
  return part;
}

}  // namespace color3d
