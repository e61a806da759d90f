#include "client/commands/key_jobs.h"

#include <nlohmann/json.hpp>

#include "client/commands/results.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "core/base/error.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace {

constexpr int kPageSize = 200;
constexpr int kMaxPages = 50;

// Newest first; stops when both are found.
void FindNewest(Connection& connection, KeyState* state) {
  v1::ListJobsRequest request;
  request.set_parent(state->scene.name());
  request.set_page_size(kPageSize);
  for (int page = 0; page < kMaxPages && !(state->selected && state->colored); ++page) {
    const auto jobs = connection.Call(&v1::JobService::Stub::ListJobs, connection.jobs(), request);
    for (const v1::Job& job : jobs.jobs()) {
      if (job.state() != v1::Job::STATE_SUCCEEDED || !job.parent().empty()) continue;
      if (job.kind() == kind::kSelectKeyView && !state->selected) state->selected = job;
      if (job.kind() == kind::kColorizeKeyView && !state->colored &&
          job.spec().colorize_key_view().view().empty()) {
        state->colored = job;
      }
    }
    if (jobs.next_page_token().empty()) return;
    request.set_page_token(jobs.next_page_token());
  }
}

}  // namespace

KeyState ReadKeyState(Connection& connection, const std::string& scene) {
  KeyState state;
  state.scene = GetScene(connection, scene);
  FindNewest(connection, &state);
  if (!state.scene.key_color_job().empty()) {
    state.accepted = GetJob(connection, state.scene.key_color_job());
  }
  return state;
}

std::vector<std::string> JobAndInputs(Connection& connection, const v1::Job& job) {
  std::vector<std::string> names(job.spec().inputs().begin(), job.spec().inputs().end());
  for (const v1::Job& child : ListChildren(connection, job.name())) names.push_back(child.name());
  names.push_back(job.name());
  return names;
}

KeyViewChoice ReadChoice(Connection& connection, const v1::Job& job) {
  for (const std::string& name : JobAndInputs(connection, job)) {
    const v1::Job input = name == job.name() ? job : GetJob(connection, name);
    if (input.kind() != kind::kSelectKeyView) continue;
    const auto json = nlohmann::json::parse(
        ReadArtifact(connection, input, artifact::kKeyView), nullptr, /*allow_exceptions=*/false);
    if (!json.is_object()) break;
    KeyViewChoice choice{json.value("view", ""), json.value("description", ""), {}};
    for (const auto& chosen : json.value("key_views", nlohmann::json::array())) {
      choice.views.push_back(chosen.value("view", ""));
    }
    if (choice.views.empty()) choice.views = {choice.view};
    return choice;
  }
  throw Error(ErrorCode::kNotFound,
              "{} has no key view: its {} job was deleted; select again",
              job.name(),
              kind::kSelectKeyView);
}

std::string DescribeSource(const v1::Job& job) {
  const v1::KeyColorSource& source = job.spec().colorize_key_view().source();
  const auto* field = source.GetReflection()->GetOneofFieldDescriptor(
      source, source.GetDescriptor()->FindOneofByName("source"));
  if (field == nullptr) return "nothing";
  std::string text = field->name();
  if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING) {
    text += " \"" + source.GetReflection()->GetString(source, field) + "\"";
  }
  const bool is_backend = source.source_case() == v1::KeyColorSource::kBackend;
  if (source.has_backend_input() && !is_backend) text += ", points above it";
  return text;
}

v1::Scene AcceptKeyColor(Connection& connection, const std::string& scene, const std::string& job) {
  v1::AcceptKeyColorRequest request;
  request.set_name(scene);
  request.set_job(job);
  request.set_request_id(NewUuid());
  return connection.Call(&v1::SceneService::Stub::AcceptKeyColor, connection.scenes(), request);
}

}  // namespace color3d::client
