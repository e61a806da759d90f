#include "server/planning/job_plan.h"

#include <algorithm>
#include <string>

#include "core/catalogue/cost_model.h"
#include "core/catalogue/iteration_cap.h"
#include "core/catalogue/memory_model.h"
#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/spec_check.h"
#include "server/planning/spec_names.h"
#include "server/planning/time_budget.h"

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr int kSideOfSmallPicturesPx = 500;  // of stages without a working size of their own

// Value of a number among the options of a stage; `otherwise` if it is unset or there is no such
// option.
template <typename Number>
Number NumberOf(const Message& options, const std::string& name, Number otherwise) {
  const FieldDescriptor* field = options.GetDescriptor()->FindFieldByName(name);
  if (field == nullptr || !options.GetReflection()->HasField(options, field)) return otherwise;
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return static_cast<Number>(options.GetReflection()->GetInt32(options, field));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return static_cast<Number>(options.GetReflection()->GetDouble(options, field));
    default:
      return otherwise;
  }
}

const Message& OptionsOf(const v1::JobSpec& spec) {
  const FieldDescriptor* field = spec.GetDescriptor()->FindFieldByName(KindOf(spec));
  return spec.GetReflection()->GetMessage(spec, field);
}

StageWork WorkOf(const v1::JobSpec& stage,
                 const SceneFacts& facts,
                 const v1::ImportSceneSpec& import) {
  const Message& options = OptionsOf(stage);
  const ExpectedViews views = ViewsOf(facts, import);
  const int side = NumberOf<int>(options, "max_side_px", kSideOfSmallPicturesPx);
  StageWork work;
  work.views = views.count;
  work.megapixels = AssumedMegapixels(side, views.are_frames);
  const v1::PersonalizeSpec& personalize = stage.personalize();
  const bool trains = personalize.recipe() != v1::PersonalizeSpec::RECIPE_FEED_FORWARD &&
                      !personalize.has_colorizer();
  work.iterations = trains ? NumberOf<int>(options, "iterations", 0) : 0;
  if (stage.has_reconstruct_geometry() &&
      stage.reconstruct_geometry().recipe() != v1::ReconstructGeometrySpec::RECIPE_PAPER) {
    work.iterations = IterationCap(work.iterations, views.count);
  }
  work.gaussians = NumberOf<int>(options, "max_gaussians", 0);
  work.sh_degree = NumberOf<int>(options, "sh_degree", 0);
  work.kind = views.kind;
  work.estimates_poses = EstimatesPoses(facts, import);
  work.geometry_given = views.have_geometry;
  work.key_view_given =
      stage.select_key_view().strategy() == v1::SelectKeyViewSpec::STRATEGY_MANUAL;
  work.ends_early = personalize.min_improvement() > 0.0;
  work.paper_recipe = personalize.recipe() == v1::PersonalizeSpec::RECIPE_PAPER;
  return work;
}

// `geometry`: options of the geometry stage in the same graph, which decide the work of later
// stages too; nullptr if there is none.
StageWork WorkWithGeometry(const v1::JobSpec& stage,
                           const v1::ReconstructGeometrySpec* geometry,
                           const SceneFacts& facts,
                           const v1::ImportSceneSpec& import) {
  StageWork work = WorkOf(stage, facts, import);
  work.trains_jointly =
      geometry != nullptr && stage.solve_chroma().solver() == v1::SolveChromaSpec::SOLVER_JOINT;
  if (geometry != nullptr && !stage.has_reconstruct_geometry()) {
    work.gaussians = geometry->max_gaussians();
    work.sh_degree = geometry->sh_degree();
    if (work.trains_jointly) work.iterations = geometry->iterations();
  }
  return work;
}

// At most its time limit.
double SecondsOf(const v1::JobSpec& stage, const StageWork& work) {
  const double seconds = EstimateSeconds(KindOf(stage), work);
  const double limit = NumberOf<double>(OptionsOf(stage), "time_limit_seconds", 0.0);
  return limit > 0.0 ? std::min(seconds, limit) : seconds;
}

std::string ReasonToRun(const v1::JobSpec& spec,
                        const SceneFacts& facts,
                        const v1::ImportSceneSpec& import) {
  const std::string kind = KindOf(spec);
  if (spec.has_import_scene() && !EstimatesPoses(facts, import)) {
    return "the files are read; no camera poses are searched for";
  }
  if (spec.has_select_key_view() &&
      spec.select_key_view().strategy() == v1::SelectKeyViewSpec::STRATEGY_MANUAL) {
    return "the key view was given: " + spec.select_key_view().view();
  }
  if (spec.has_colorize_key_view() && ColorsAdditionalKeyView(spec)) {
    return "additional key view " + spec.colorize_key_view().view();
  }
  if (spec.has_reconstruct_geometry() && ViewsOf(facts, import).have_geometry) {
    return "the scene's Gaussians were given; nothing is trained";
  }
  if (spec.has_evaluate() && spec.evaluate().truth().empty()) {
    return "no true colours were given: the views are compared with each other only";
  }
  const char* purpose = StageOf(kind).purpose;
  return purpose == nullptr ? "" : purpose;
}

bool IsComposite(const v1::JobSpec& spec) {
  return spec.has_colorize_scene() || spec.has_personalize_scenes();
}

// Geometry stage of the graph; nullptr if there is none, or if it is left out.
const v1::JobSpec* FindGeometry(const std::vector<v1::JobSpec>& specs, const NewGraph& graph) {
  for (size_t i = 0; i < specs.size(); ++i) {
    if (specs[i].has_reconstruct_geometry() && graph.jobs[i].skip_reason.empty()) return &specs[i];
  }
  return nullptr;
}

// Sets the peak of the run and, for stages that are left out, the bytes that this saves.
void SetPeakMemory(v1::JobPlan* plan) {
  int64_t peak = 0, saved = 0;
  for (const v1::PlannedStage& stage : plan->stages()) {
    if (stage.runs()) peak = std::max(peak, stage.expected_peak_memory_bytes());
  }
  for (v1::PlannedStage& stage : *plan->mutable_stages()) {
    if (stage.runs()) continue;
    const int64_t above = std::max<int64_t>(0, stage.expected_peak_memory_bytes() - peak);
    stage.set_expected_peak_memory_bytes(above);
    saved = std::max(saved, above);
  }
  plan->set_expected_peak_memory_bytes(peak);
  plan->set_saved_memory_bytes(saved);
}

// Job of a graph that is no composite, with its options and its work.
struct StageOfGraph {
  size_t index = 0;
  v1::JobSpec spec;
  StageWork work;
};

std::vector<StageOfGraph> StagesOf(const NewGraph& graph,
                                   const SceneFacts& facts,
                                   const v1::ImportSceneSpec& import) {
  std::vector<v1::JobSpec> specs;
  for (const NewJob& job : graph.jobs) specs.push_back(ParseSpec(job.spec, job.kind));
  const v1::JobSpec* given = FindGeometry(specs, graph);
  const auto* geometry = given == nullptr ? nullptr : &given->reconstruct_geometry();
  std::vector<StageOfGraph> stages;
  for (size_t i = 0; i < specs.size(); ++i) {
    if (IsComposite(specs[i])) continue;
    stages.push_back({i, specs[i], WorkWithGeometry(specs[i], geometry, facts, import)});
  }
  return stages;
}

}  // namespace

double EstimateJobSeconds(const v1::JobSpec& stage,
                          const SceneFacts& facts,
                          const v1::ImportSceneSpec& import) {
  return SecondsOf(stage, WorkWithGeometry(stage, nullptr, facts, import));
}

MachineFactor MeasureMachine(const std::vector<MeasuredJob>& jobs) {
  constexpr size_t kFewestJobs = 3;
  constexpr double kLimit = 20.0;
  std::vector<double> ratios;
  for (const MeasuredJob& job : jobs) {
    if (job.expected_seconds >= 1.0 && job.seconds > 0.0) {
      ratios.push_back(job.seconds / job.expected_seconds);
    }
  }
  if (ratios.size() < kFewestJobs) return {};
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return {std::clamp(*middle, 1.0 / kLimit, kLimit), static_cast<int>(ratios.size())};
}

v1::JobPlan DescribeGraph(const NewGraph& graph,
                          const SceneFacts& facts,
                          const v1::ImportSceneSpec& import,
                          const MachineFactor& machine) {
  v1::JobPlan plan;
  plan.set_machine_factor(machine.factor);
  plan.set_measured_jobs(machine.jobs);
  double expected = 0.0, saved = 0.0;
  for (const auto& [index, spec, work] : StagesOf(graph, facts, import)) {
    const NewJob& job = graph.jobs[index];
    const std::string& skip_reason = job.skip_reason;
    const double seconds = machine.factor * SecondsOf(spec, work);
    v1::PlannedStage* stage = plan.add_stages();
    stage->set_kind(job.kind);
    stage->set_runs(skip_reason.empty());
    stage->set_reason(skip_reason.empty() ? ReasonToRun(spec, facts, import) : skip_reason);
    stage->set_expected_seconds(seconds);
    stage->set_expected_peak_memory_bytes(EstimatePeakBytes(job.kind, work));
    (skip_reason.empty() ? expected : saved) += seconds;
  }
  plan.set_expected_seconds(expected);
  plan.set_saved_seconds(saved);
  SetPeakMemory(&plan);
  return plan;
}

void SetNeeds(const SceneFacts& facts, const v1::ImportSceneSpec& import, NewGraph* graph) {
  for (const auto& [index, spec, work] : StagesOf(*graph, facts, import)) {
    NewJob& job = graph->jobs[index];
    const SpecNames names = NamesIn(spec);
    for (const NameUse& use : names.models) job.needs.models.push_back(ModelNeed(use.name));
    for (const NameUse& use : names.backends) job.needs.models.push_back(BackendNeed(use.name));
    job.needs.batch_group = spec.personalize().encoder();
    job.needs.memory_bytes = EstimatePeakBytes(job.kind, work);
  }
}

}  // namespace color3d
