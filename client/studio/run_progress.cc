#include "client/studio/run_progress.h"

#include <algorithm>
#include <vector>

#include "client/lib/job_watch.h"
#include "client/lib/text.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace {

using Json = nlohmann::ordered_json;

// Place of a kind in the pipeline.
size_t PlaceOf(const std::string& kind) {
  const auto& catalogue = StageCatalogue();
  const auto row = std::ranges::find_if(catalogue, [&](const Stage& s) { return s.kind == kind; });
  return static_cast<size_t>(row - catalogue.begin());
}

double ShareOf(const v1::Job& stage) {
  if (stage.state() == v1::Job::STATE_SUCCEEDED) return 1.0;
  const v1::Progress& progress = stage.progress();
  if (progress.total_steps() <= 0) return 0.0;
  return std::clamp(
      static_cast<double>(progress.step()) / static_cast<double>(progress.total_steps()), 0.0, 1.0);
}

bool IsPicture(const v1::Artifact& artifact) {
  return artifact.media_type() == "image/png" || artifact.media_type() == "image/jpeg";
}

// The key of a job in the service's answer for a coloured scene; "" if the service chooses it.
std::string KeyViewOf(const v1::JobSpec& spec) {
  if (spec.has_colorize_scene()) return spec.colorize_scene().key_view();
  if (spec.has_select_key_view()) return spec.select_key_view().view();
  return "";
}

}  // namespace

std::string IdOf(const std::string& resource) { return resource.substr(resource.find('/') + 1); }

Json JobFacts(const v1::Job& job) {
  Json json = {{"id", IdOf(job.name())},
               {"scene", IdOf(job.spec().scene())},
               {"kind", job.kind()},
               {"state", StateName(job.state())},
               {"created_s", job.create_time().seconds()},
               {"ended_s", job.end_time().seconds()},
               {"key_view", KeyViewOf(job.spec())},
               {"queue_position", job.queue_position()},
               {"waits_for", job.waits_for()}};
  if (job.has_error()) json["error"] = job.error().message();
  Json warnings = Json::array();
  for (const std::string& warning : job.warnings()) warnings.push_back(warning);
  json["warnings"] = warnings;
  return json;
}

RunProgress::RunProgress(const v1::Job& job, const std::optional<v1::JobPlan>& plan) : job_(job) {
  if (!plan) return;
  for (const v1::PlannedStage& stage : plan->stages()) {
    if (stage.runs()) expected_[stage.kind()] += stage.expected_seconds();
  }
}

void RunProgress::OnEvent(const v1::JobEvent& event) {
  if (!event.has_job()) return;
  const v1::Job& job = event.job();
  estimate_.OnJob(job);
  const bool is_own = job.name() == job_.name();
  v1::Job& known = is_own ? job_ : stages_[job.name()];
  if (event.kind() == v1::JobEvent::KIND_STATE) {
    known = job;
    if (is_own) stages_.erase(job.name());
    return;
  }
  known.set_name(job.name());
  known.set_kind(job.kind());
  known.set_state(job.state());
  *known.mutable_progress() = job.progress();
}

double RunProgress::SecondsLeft(const v1::Job& stage) const {
  if (IsFinished(stage.state())) return 0.0;
  const v1::Progress& progress = stage.progress();
  if (stage.state() == v1::Job::STATE_RUNNING && progress.eta_seconds() >= 0.0 &&
      progress.step() > 0) {
    return progress.eta_seconds();
  }
  const auto expected = expected_.find(stage.kind());
  if (expected == expected_.end()) return 0.0;
  return std::max(0.0, expected->second - progress.seconds());
}

Json RunProgress::ToJson() const {
  std::vector<const v1::Job*> ordered;
  for (const auto& [name, stage] : stages_) ordered.push_back(&stage);
  std::ranges::sort(ordered, [](const v1::Job* a, const v1::Job* b) {
    return PlaceOf(a->kind()) < PlaceOf(b->kind());
  });
  Json stages = Json::array(), pictures = Json::array();
  double left = 0.0;
  for (const v1::Job* stage : ordered) {
    const double seconds_left = SecondsLeft(*stage);
    left += seconds_left;
    Json row = {{"id", IdOf(stage->name())},
                {"kind", stage->kind()},
                {"state", StateName(stage->state())},
                {"cached", stage->cached()},
                {"share", ShareOf(*stage)},
                {"message", stage->progress().message()},
                {"seconds", stage->progress().seconds()},
                {"seconds_left", seconds_left}};
    if (!stage->skip_reason().empty()) row["left_out"] = stage->skip_reason();
    if (stage->has_error()) row["error"] = stage->error().message();
    stages.push_back(row);
    for (const v1::Artifact& artifact : stage->artifacts()) {
      if (!IsPicture(artifact)) continue;
      pictures.push_back(
          {{"job", IdOf(stage->name())}, {"kind", stage->kind()}, {"name", artifact.name()}});
    }
  }
  Json json = JobFacts(job_);
  json["stages"] = stages;
  json["seconds_left"] = expected_.empty() && left == 0.0 ? Json() : Json(left);
  const auto error = estimate_.error();
  json["expected_error"] = error ? Json(*error) : Json();
  json["pictures"] = pictures;
  Json artifacts = Json::array();
  for (const v1::Artifact& artifact : job_.artifacts()) {
    artifacts.push_back({{"name", artifact.name()},
                         {"media_type", artifact.media_type()},
                         {"bytes", artifact.digest().size_bytes()}});
  }
  json["artifacts"] = artifacts;
  return json;
}

}  // namespace color3d::client
