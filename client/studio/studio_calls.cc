#include "client/studio/studio_calls.h"

#include <algorithm>
#include <chrono>
#include <set>

#include "client/commands/follow.h"
#include "client/commands/key_jobs.h"
#include "client/commands/results.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "client/lib/live_coloring.h"
#include "client/lib/names.h"
#include "client/lib/scene_upload.h"
#include "client/lib/text.h"
#include "client/options/colorize_options.h"
#include "client/options/key_color_flags.h"
#include "client/studio/correct/versions.h"
#include "client/studio/found_photos.h"
#include "client/studio/live_png.h"
#include "client/studio/run_progress.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/limits.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace {

using Json = nlohmann::ordered_json;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kJobsInList = 100;
constexpr milliseconds kBetweenStates{250};
constexpr milliseconds kQuiet{10'000};

ColorizeOptions OptionsOf(const RunChoices& choices) {
  ColorizeOptions options;
  options.preset = choices.preset;
  options.key_view = choices.key.view;
  options.time_budget_seconds = choices.time_budget_seconds;
  options.poses = choices.poses;
  return options;
}

// Throws Error{kInvalidArgument} unless each has a photo of its own.
void CheckKeyViews(const RunChoices& choices) {
  if (choices.further.size() > size_t{kMaxAdditionalKeyViews}) {
    throw InvalidArgument("{} more photos are coloured; at most {} are used",
                          choices.further.size(),
                          kMaxAdditionalKeyViews);
  }
  std::set<std::string> views = {choices.key.view};
  for (const KeyChoice& one : choices.further) {
    if (choices.key.view.empty() || one.view.empty()) {
      throw InvalidArgument("choose the photos that the colours belong to");
    }
    if (!views.insert(one.view).second) {
      throw InvalidArgument("the photo {} is coloured twice; remove one of them", one.view);
    }
  }
}

Json PlanJson(const v1::JobPlan& plan) {
  Json stages = Json::array(), budgets = Json::array();
  for (const v1::PlannedStage& stage : plan.stages()) {
    stages.push_back({{"kind", stage.kind()},
                      {"runs", stage.runs()},
                      {"reason", stage.reason()},
                      {"seconds", stage.expected_seconds()},
                      {"bytes", stage.expected_peak_memory_bytes()}});
  }
  for (const v1::BudgetError& row : plan.budget_errors()) {
    Json budget = {{"seconds", row.budget_seconds()}, {"too_short", row.too_short()}};
    if (!row.too_short()) {
      budget.update({{"error", row.error()}, {"low", row.low()}, {"high", row.high()}});
    }
    budgets.push_back(budget);
  }
  return {{"seconds", plan.expected_seconds()},
          {"bytes", plan.expected_peak_memory_bytes()},
          {"measured_jobs", plan.measured_jobs()},
          {"stages", stages},
          {"budgets", budgets}};
}

std::optional<v1::JobPlan> PlanOf(Connection& connection, const v1::PlanJobRequest& request) {
  try {
    return connection.Call(&v1::JobService::Stub::PlanJob, connection.jobs(), request);
  } catch (const RpcError&) {  // an older server, or options that it no longer takes
    return std::nullopt;
  }
}

// The stage of a run that coloured its key view; nullopt if it has not ended yet.
std::optional<v1::Job> ColoredKey(Connection& connection, const v1::Job& run) {
  std::vector<v1::Job> jobs = ListChildren(connection, run.name());
  for (const std::string& input : run.spec().inputs()) jobs.push_back(GetJob(connection, input));
  for (const v1::Job& job : jobs) {
    const bool has_colored = std::ranges::any_of(job.artifacts(), [](const v1::Artifact& artifact) {
      return artifact.name() == artifact::kKeyViewColored;
    });
    if (has_colored) return job;
  }
  return std::nullopt;
}

}  // namespace

Json StudioCalls::ServerFacts() const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::ServerInfo info = GetServerInfo(connection);
  const bool knows_words = std::ranges::any_of(
      info.models(), [](const v1::ModelInfo& model) { return model.kind() == "clip"; });
  Json presets = Json::array();
  for (const v1::PresetInfo& preset : info.presets()) presets.push_back(preset.name());
  return {{"version", info.version()},
          {"address", connection.address()},
          {"presets", presets},
          {"knows_words", knows_words}};
}

Json StudioCalls::Plan(const PhotoFolder& folder, const RunChoices& choices) const {
  v1::PlanJobRequest request;
  *request.mutable_spec() = ColorizeSpec(OptionsOf(choices), "");
  request.mutable_spec()->mutable_colorize_scene()->set_key_view(choices.key.view);
  // Every source of colour takes about the same time.
  request.mutable_spec()->mutable_colorize_scene()->mutable_key_color()->set_automatic(true);
  *request.mutable_facts() = CaptureFactsOf(folder);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  return PlanJson(connection.Call(&v1::JobService::Stub::PlanJob, connection.jobs(), request));
}

std::string StudioCalls::Upload(const PhotoFolder& folder) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const auto entries = BuildManifest(folder, MaxFileBytes(connection), connection_.cancel());
  return UploadScene(connection, entries, folder.Name(), [](int64_t, int64_t) {}).name();
}

v1::Job StudioCalls::SelectKeyView(const std::string& scene, int count) const {
  v1::JobSpec spec;
  spec.set_scene(ResourceName(scene, "scenes"));
  spec.mutable_select_key_view();
  if (count > 1) spec.mutable_select_key_view()->set_count(count);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  return SubmitJob(connection, spec);
}

Json StudioCalls::KeyViews(const std::string& job) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job select = GetJob(connection, ResourceName(job, "jobs"));
  const Json found = Json::parse(
      ReadArtifact(connection, select, artifact::kKeyView), nullptr, /*allow_exceptions=*/false);
  if (!found.is_object()) {
    throw Error(ErrorCode::kDataLoss, "{} has no key view; select again", select.name());
  }
  Json views = Json::array();
  std::optional<double> before;
  for (const Json& view : found.value("key_views", Json::array())) {
    Json row = {{"name", view.value("view", "")}, {"expected_error", nullptr}, {"saves", nullptr}};
    if (view.contains("expected_error") && view["expected_error"].is_number()) {
      const double error = view["expected_error"];
      row["expected_error"] = error;
      if (before) row["saves"] = *before - error;
      before = error;
    }
    views.push_back(row);
  }
  if (views.empty()) {
    views.push_back(
        {{"name", found.value("view", "")}, {"expected_error", nullptr}, {"saves", nullptr}});
  }
  return {{"view", found.value("view", "")},
          {"description", found.value("description", "")},
          {"views", views},
          {"ranking", found.value("ranking", Json::array())}};
}

v1::Job StudioCalls::Colorize(const std::string& scene, const RunChoices& choices) const {
  if (choices.key.color.from != ColorChoice::From::kAutomatic && choices.key.view.empty()) {
    throw InvalidArgument("choose the photo that the colours belong to");
  }
  CheckKeyViews(choices);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  v1::JobSpec spec = ColorizeSpec(OptionsOf(choices), ResourceName(scene, "scenes"));
  v1::ColorizeSceneSpec& job = *spec.mutable_colorize_scene();
  job.set_key_view(choices.key.view);
  *job.mutable_key_color() = UploadColors(connection, choices.key.color, choices.key.strokes_file);
  for (const KeyChoice& key : choices.further) {
    v1::FurtherKeyView* added = job.mutable_carry_color()->add_further_key_views();
    added->set_view(key.view);
    *added->mutable_color() = UploadColors(connection, key.color, key.strokes_file);
  }
  return SubmitJob(connection, spec);
}

v1::Job StudioCalls::Cancel(const std::string& job) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  return CancelJob(*kept, ResourceName(job, "jobs"));
}

v1::Job StudioCalls::Retry(const std::string& job) const {
  v1::RetryJobRequest request;
  request.set_name(ResourceName(job, "jobs"));
  request.set_request_id(NewUuid());
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  return connection.Call(&v1::JobService::Stub::RetryJob, connection.jobs(), request);
}

v1::Job StudioCalls::Job(const std::string& job) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  return GetJob(connection, ResourceName(job, "jobs"));
}

Json StudioCalls::Jobs() const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  Json list = Json::array();
  std::set<std::string> versions;
  ForEachJob(connection, "", [&](const v1::Job& job) {
    if (job.kind() != kind::kColorizeScene || !job.parent().empty()) return true;
    const std::string plain = WithoutCorrections(job.spec());
    if (versions.contains(plain)) return true;  // a newer one is in the list
    const bool is_over =
        job.state() == v1::Job::STATE_FAILED || job.state() == v1::Job::STATE_CANCELLED;
    if (!is_over) versions.insert(plain);
    list.push_back(JobFacts(job));
    return list.size() < kJobsInList;
  });
  return list;
}

void StudioCalls::Watch(const std::string& job,
                        const std::function<bool(const std::string&)>& send) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job run = GetJob(connection, ResourceName(job, "jobs"));
  v1::PlanJobRequest plan;
  *plan.mutable_spec() = run.spec();
  const bool is_planned = run.spec().has_colorize_scene() && !IsFinished(run.state());
  RunProgress progress(run, is_planned ? PlanOf(connection, plan) : std::nullopt);
  bool is_new = true, goes_on = true;
  auto last = steady_clock::now() - kQuiet;
  const auto tell = [&](bool at_once) {
    const auto now = steady_clock::now();
    if (is_new && (at_once || now - last >= kBetweenStates)) {
      goes_on =
          send(progress.ToJson().dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
      is_new = false;
      last = now;
    } else if (now - last >= kQuiet) {
      goes_on = send("");
      last = now;
    }
    return goes_on;
  };
  const auto on_event = [&](const v1::JobEvent& event) {
    progress.OnEvent(event);
    is_new = is_new || event.has_job();
  };
  const auto keep_going = [&] {
    connection_.cancel().ThrowIfCancelled();
    return tell(/*at_once=*/false);
  };
  WatchJobs(connection, {run.name()}, on_event, keep_going);
  is_new = is_new && goes_on;
  if (is_new) tell(/*at_once=*/true);
}

std::string StudioCalls::Fetch(const std::string& job,
                               const std::string& artifact,
                               const std::filesystem::path& file) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job made = GetJob(connection, ResourceName(job, "jobs"));
  const v1::Artifact& found = FindArtifact(made, artifact);
  DownloadBlob(
      connection, {found.digest().sha256(), found.digest().size_bytes()}, file, [](int64_t) {});
  return found.media_type();
}

std::string StudioCalls::PreviewOfRun(const std::string& job,
                                      const LocalFile& photo,
                                      int max_side_px) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job run = GetJob(connection, ResourceName(job, "jobs"));
  const std::optional<v1::Job> colored = ColoredKey(connection, run);
  if (!colored) {
    throw Error(
        ErrorCode::kFailedPrecondition, "the key view of {} is not coloured yet", run.name());
  }
  LiveSource source;
  source.example = FindArtifact(*colored, artifact::kKeyViewColored).digest();
  return LivePng(connection, source, {photo.path, photo.file, std::nullopt}, max_side_px);
}

std::string StudioCalls::Preview(const LocalFile& photo,
                                 const ColorChoice& color,
                                 const std::string& made_by,
                                 int max_side_px) const {
  using From = ColorChoice::From;
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  LiveSource source;
  source.points = color.strokes;
  if (color.from == From::kAutomatic) source.colorizer = kAutomaticColorizer;
  if (color.from == From::kReference || color.from == From::kWords) {
    const v1::Job made = GetJob(connection, ResourceName(made_by, "jobs"));
    source.example = FindArtifact(made, artifact::kKeyViewColored).digest();
  }
  const auto ask = [&] {
    if (color.from == From::kPicture) source.example = blobs_.Of(connection, color.picture);
    const v1::Digest digest = blobs_.Of(connection, photo.file);
    return LivePng(connection, source, {photo.path, {}, digest}, max_side_px);
  };
  try {
    return ask();
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kNotFound && e.code() != ErrorCode::kFailedPrecondition) throw;
    blobs_.Forget();  // another service, or it has removed what nothing used
    return ask();
  }
}

v1::Job StudioCalls::ColorBelow(const std::string& scene,
                                const std::string& view,
                                const ColorChoice& color) const {
  if (view.empty()) throw InvalidArgument("choose the photo that the colours belong to");
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  v1::JobSpec select;
  select.set_scene(ResourceName(scene, "scenes"));
  select.mutable_select_key_view()->set_strategy(v1::SelectKeyViewSpec::STRATEGY_MANUAL);
  select.mutable_select_key_view()->set_view(view);
  v1::JobSpec spec;
  spec.set_scene(select.scene());
  *spec.mutable_colorize_key_view()->mutable_source() = UploadColors(connection, color, {});
  const v1::Job selected = SubmitJob(connection, select);
  for (const std::string& input : JobAndInputs(connection, selected)) spec.add_inputs(input);
  return SubmitJob(connection, spec);
}

}  // namespace color3d::client
