#include "server/planning/graph_builder.h"

#include <set>
#include <utility>

#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "server/base/service_error.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/spec_check.h"

namespace color3d {
namespace {

std::string ProviderOf(const std::string& artifact) {
  const Stage* stage = FindProducer(artifact);
  if (stage == nullptr) throw Error(ErrorCode::kInternal, "no stage leaves '{}'", artifact);
  return stage->kind;
}

// Later stages do not depend on a job that only proposes corrections: they stay cached.
bool IsKeyViewProposal(const NewJob& job) {
  return job.kind == kind::kCorrectColors &&
         ParseSpec(job.spec, job.kind).correct_colors().corrections().empty();
}

}  // namespace

GraphBuilder::GraphBuilder(const v1::JobSpec& submitted,
                           const std::vector<JobRecord>& inputs,
                           FillUnset fill_unset)
    : submitted_(submitted),
      submitted_kind_(KindOf(submitted)),
      fill_unset_(std::move(fill_unset)) {
  graph_.scene = submitted.scene();
  for (const JobRecord& input : inputs) {
    if (input.scene != submitted.scene()) {
      throw InvalidArgument("the input {} belongs to '{}', the job to '{}'",
                            input.name,
                            input.scene,
                            submitted.scene());
    }
    if (input.kind == kind::kColorizeKeyView &&
        ColorsAdditionalKeyView(ParseSpec(input.spec, input.name))) {
      continue;
    }
    const auto [it, fresh] = given_.emplace(input.kind, input);
    if (!fresh && it->second.name != input.name) {
      throw InvalidArgument("both inputs {} and {} are {} jobs; give one of them",
                            it->second.name,
                            input.name,
                            input.kind);
    }
  }
}

v1::JobSpec GraphBuilder::StageSpec(const std::string& kind) const {
  v1::JobSpec spec;
  spec.set_scene(submitted_.scene());
  spec.set_seed(submitted_.seed());
  spec.set_skip_cache(submitted_.skip_cache());
  MutableStage(&spec, kind);
  return spec;
}

void GraphBuilder::Provide(const std::string& artifact, const std::string& for_kind, NewJob* job) {
  const std::string provider = ProviderOf(artifact);
  const auto planned = planned_.find(provider);
  if (planned != planned_.end()) {
    // A skipped job is no dependency.
    if (graph_.jobs[static_cast<size_t>(planned->second)].skip_reason.empty()) {
      job->inputs.push_back(planned->second);
    }
    return;
  }
  const auto given = given_.find(provider);
  if (given != given_.end()) {
    const JobRecord& input = given->second;
    if (IsFinished(input.state) && input.state != JobState::kSucceeded) {
      throw ServiceError(ErrorReason::kInputMissing,
                         "{} needs {}, but the input {} is {}; retry it first",
                         for_kind,
                         artifact,
                         input.name,
                         JobStateName(input.state));
    }
    job->input_jobs.push_back(input.name);
    return;
  }
  if (!StageOf(submitted_kind_).brings_prerequisites) {
    throw ServiceError(ErrorReason::kInputMissing,
                       "{} needs {}; add the {} job of this scene to spec.inputs",
                       for_kind,
                       artifact,
                       provider);
  }
  Add(StageSpec(provider));
  job->inputs.push_back(planned_.at(provider));
}

void GraphBuilder::LinkIfThere(const std::string& provider, NewJob* job) const {
  const auto planned = planned_.find(provider);
  const auto given = given_.find(provider);
  if (planned != planned_.end()) {
    const int index = planned->second;
    const NewJob& other = graph_.jobs[static_cast<size_t>(index)];
    if (other.skip_reason.empty() && !IsKeyViewProposal(other)) job->inputs.push_back(index);
  } else if (given != given_.end() &&
             (!IsFinished(given->second.state) || given->second.state == JobState::kSucceeded)) {
    job->input_jobs.push_back(given->second.name);
  }
}

int GraphBuilder::Append(NewJob job, const v1::JobSpec& spec) {
  job.spec = DeterministicBytes(spec);
  for (const FileDigest& digest : SpecBlobs(spec)) job.blobs.push_back(digest.sha256);
  graph_.jobs.push_back(std::move(job));
  return static_cast<int>(graph_.jobs.size()) - 1;
}

int GraphBuilder::AddKeyView(const v1::FurtherKeyView& view) {
  v1::JobSpec spec = StageSpec(kind::kColorizeKeyView);
  spec.mutable_colorize_key_view()->set_view(view.view());
  *spec.mutable_colorize_key_view()->mutable_source() = view.color();
  NewJob job;
  job.kind = kind::kColorizeKeyView;
  Provide(artifact::kScene, job.kind, &job);
  return Append(std::move(job), spec);
}

void GraphBuilder::AddJointKeyViews(
    const google::protobuf::RepeatedPtrField<v1::FurtherKeyView>& views) {
  for (const v1::FurtherKeyView& view : views) joint_key_views_.push_back(AddKeyView(view));
}

void GraphBuilder::Add(v1::JobSpec spec, const std::string& skip_reason) {
  NewJob job;
  job.kind = KindOf(spec);
  if (submitted_.has_colorize_scene() && given_.contains(job.kind)) return;
  job.skip_reason = skip_reason;
  const Stage& stage = StageOf(job.kind);
  std::set<std::string> linked;  // a stage may read several artifacts of another
  for (const char* artifact : stage.needs) {
    if (linked.insert(ProviderOf(artifact)).second) Provide(artifact, job.kind, &job);
  }
  for (const char* artifact : stage.reads) {
    const std::string provider = ProviderOf(artifact);
    if (linked.insert(provider).second) LinkIfThere(provider, &job);
  }
  if (job.kind == kind::kPersonalize || job.kind == kind::kColorizeViews) {
    job.inputs.insert(job.inputs.end(), joint_key_views_.begin(), joint_key_views_.end());
  }
  fill_unset_(&spec);
  if (skip_reason.empty()) {
    for (v1::FurtherKeyView* view : AdditionalKeyViews(&spec)) {
      job.inputs.push_back(AddKeyView(*view));
      view->clear_color();
    }
  }
  planned_[stage.kind] = Append(std::move(job), spec);
}

void GraphBuilder::AddParent() {
  NewJob parent;
  parent.kind = submitted_kind_;
  for (size_t i = 0; i < graph_.jobs.size(); ++i) parent.inputs.push_back(static_cast<int>(i));
  for (const auto& [kind, job] : given_) parent.input_jobs.push_back(job.name);
  Append(std::move(parent), submitted_);
}

}  // namespace color3d
