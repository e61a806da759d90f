#include "client/studio/correct/corrections.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <utility>

#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/out_folder.h"
#include "client/options/key_color_flags.h"
#include "client/studio/correct/scene_views.h"
#include "client/studio/correct/versions.h"
#include "client/studio/run_progress.h"
#include "core/base/error.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr size_t kMaxOpenRuns = 16;
constexpr size_t kMaxOpenScenes = 2;
constexpr milliseconds kBetweenLooks{2000};
constexpr milliseconds kStillHere{10'000};
constexpr int64_t kMaxStrokesBytes = 4 << 20;
constexpr int kPreparing = 200;  // priority of what nobody waits for; that of jobs is 100

Error NotCorrectable(const std::string& why) {
  return Error(ErrorCode::kFailedPrecondition, "the colours cannot be corrected here: {}", why);
}

const v1::Artifact* FindIn(const v1::Job& job, const std::string& name) {
  const auto found = std::ranges::find_if(
      job.artifacts(), [&](const v1::Artifact& artifact) { return artifact.name() == name; });
  return found == job.artifacts().end() ? nullptr : &*found;
}

struct Found {
  const v1::Job* job = nullptr;
  const v1::Artifact* artifact = nullptr;
};

Found FindIn(const std::vector<v1::Job>& jobs, const std::string& name) {
  for (const v1::Job& job : jobs) {
    if (const v1::Artifact* artifact = FindIn(job, name)) return {&job, artifact};
  }
  return {};
}

// The stages of a run, the last ones first, and then the jobs that it was given, with theirs.
std::vector<v1::Job> StagesOf(Connection& connection, const v1::Job& run) {
  std::vector<v1::Job> stages = ListChildren(connection, run.name());
  std::ranges::reverse(stages);
  std::vector<std::string> wanted(run.spec().inputs().begin(), run.spec().inputs().end());
  std::set<std::string> known;
  for (const v1::Job& stage : stages) known.insert(stage.name());
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (!known.insert(wanted[i]).second) continue;
    stages.push_back(GetJob(connection, wanted[i]));
    for (v1::Job& child : ListChildren(connection, wanted[i])) {
      if (known.insert(child.name()).second) stages.push_back(std::move(child));
    }
    const auto& more = stages.back().spec().inputs();
    wanted.insert(wanted.end(), more.begin(), more.end());
  }
  return stages;
}

std::string StemOf(const std::string& view) {
  return fs::path(view).replace_extension().generic_string();
}

std::string BytesOf(Connection& connection, const v1::Digest& digest, const fs::path& file) {
  DownloadBlob(connection, {digest.sha256(), digest.size_bytes()}, file, [](int64_t) {});
  return ReadFile(file, kMaxStrokesBytes);
}

bool IsOver(const v1::Job& job) {
  return job.state() == v1::Job::STATE_FAILED || job.state() == v1::Job::STATE_CANCELLED;
}

// Runs of the scene that are versions of `run`, the newest first.
std::vector<v1::Job> VersionsOf(Connection& connection, const v1::Job& run) {
  const std::string plain = WithoutCorrections(run.spec());
  std::vector<v1::Job> versions;
  ForEachJob(connection, run.spec().scene(), [&](const v1::Job& job) {
    if (job.kind() == kind::kColorizeScene && job.parent().empty() &&
        WithoutCorrections(job.spec()) == plain) {
      versions.push_back(job);
    }
    return true;
  });
  return versions;
}

v1::JobSpec NewestSpec(const std::vector<v1::Job>& versions, const v1::Job& run) {
  const auto newest = std::ranges::find_if_not(versions, IsOver);
  return newest == versions.end() ? run.spec() : newest->spec();
}

// Of versions, the newest first: the newest that has succeeded, and a newer one that is worked on.
Json StateOf(const std::vector<v1::Job>& versions) {
  Json state = {{"newest", nullptr}, {"working", nullptr}};
  for (const v1::Job& job : versions) {
    if (IsOver(job)) continue;
    if (job.state() == v1::Job::STATE_SUCCEEDED) {
      state["newest"] = IdOf(job.name());
      break;
    }
    if (state["working"].is_null()) state["working"] = IdOf(job.name());
  }
  return state;
}

// The correction stage of `whole` alone, on what the stages of a run have made.
v1::JobSpec CorrectionOf(const std::vector<v1::Job>& stages, const v1::JobSpec& whole) {
  v1::JobSpec spec;
  spec.set_scene(whole.scene());
  spec.set_seed(whole.seed());
  *spec.mutable_correct_colors() = whole.colorize_scene().correct_colors();
  std::set<std::string> kinds;
  for (const v1::Job& stage : stages) {
    if (stage.kind() == kind::kCorrectColors || stage.state() != v1::Job::STATE_SUCCEEDED) continue;
    const Stage* row = FindStage(stage.kind());
    const Stage& correct = StageOf(kind::kCorrectColors);
    if (row == nullptr) continue;
    const auto is_read = [&](const char* output) {
      const auto same = [&](const char* wanted) { return std::string_view(wanted) == output; };
      return std::ranges::any_of(correct.needs, same) || std::ranges::any_of(correct.reads, same);
    };
    if (std::ranges::any_of(row->outputs, is_read) && kinds.insert(stage.kind()).second) {
      spec.add_inputs(stage.name());
    }
  }
  return spec;
}

// R and G of EncodeAbPng, with 8 bits; blue is the confidence.
std::string SmallAbPng(const std::string& png, const std::string& name, int side) {
  const AbMap map = DecodeAbPng(png, name);
  Image rgb(map.ab.width, map.ab.height, 3, 1.0f);
  for (int c = 0; c < 2; ++c) {
    std::transform(
        map.ab.Plane(c), map.ab.Plane(c) + map.ab.PlaneSize(), rgb.Plane(c), [](float value) {
          return (value + 128.0f) / 255.0f;
        });
  }
  return EncodePng8(FitWithin(rgb, side));
}

}  // namespace

std::shared_ptr<const SceneViews> Corrections::OpenViews(Connection& connection,
                                                         const v1::Job& job,
                                                         const v1::Artifact& scene) {
  const std::string key = scene.digest().sha256();
  {
    const MutexLock lock(mutex_);
    if (const auto known = views_.find(key); known != views_.end()) return known->second;
  }
  std::map<std::string, FileDigest> files;
  const v1::Scene uploaded = GetScene(connection, job.spec().scene());
  for (const v1::SceneFile& file : uploaded.files()) {
    files[file.path()] = {file.digest().sha256(), file.digest().size_bytes()};
  }
  const fs::path folder = files_.path() / key;
  const auto fetch = [this, folder, files = std::move(files)](const std::string& name) {
    const auto file = files.find(name);
    if (file == files.end()) {
      throw NotCorrectable("its pictures are not photos of the user");
    }
    const fs::path path = SafePathBelow(folder, name);
    if (fs::exists(path)) return;
    const std::shared_ptr<Connection> own = connection_.Get();
    DownloadBlob(*own, file->second, path, [](int64_t) {});
  };
  Scene read = SceneFromJson(ReadArtifact(connection, job, artifact::kScene));
  if (read.HasTimes()) throw NotCorrectable("the scene moves; its film has a timeline");
  auto views = std::make_shared<const SceneViews>(std::move(read), folder, fetch);
  const MutexLock lock(mutex_);
  if (views_.size() >= kMaxOpenScenes) views_.clear();
  return views_.emplace(key, std::move(views)).first->second;
}

std::shared_ptr<const Corrections::Run> Corrections::Open(const std::string& name) {
  const std::string full = ResourceName(name, "jobs");
  {
    const MutexLock lock(mutex_);
    if (const auto known = runs_.find(full); known != runs_.end()) return known->second;
  }
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  auto run = std::make_shared<Run>();
  run->job = GetJob(connection, full);
  if (run->job.kind() != kind::kColorizeScene) throw NotCorrectable("this is no coloured scene");
  run->stages = StagesOf(connection, run->job);
  for (const auto* needed : {artifact::kModel, artifact::kColorizer, artifact::kScene}) {
    if (FindIn(run->stages, needed).artifact == nullptr) {
      throw NotCorrectable(IsFinished(run->job.state()) ? "this run made no scene in 3D"
                                                        : "the scene is still being coloured");
    }
  }
  const Found scene = FindIn(run->stages, artifact::kScene);
  run->views = OpenViews(connection, *scene.job, *scene.artifact);
  const Found key = FindIn(run->stages, artifact::kKeyView);
  if (key.job != nullptr) {
    const Json found = Json::parse(ReadArtifact(connection, *key.job, artifact::kKeyView),
                                   nullptr,
                                   /*allow_exceptions=*/false);
    if (found.is_object()) run->key_view = found.value("view", "");
  }
  const bool stays = run->job.state() == v1::Job::STATE_SUCCEEDED;
  const MutexLock lock(mutex_);
  if (runs_.size() >= kMaxOpenRuns) runs_.clear();
  return stays ? runs_.emplace(full, std::move(run)).first->second : run;
}

void Corrections::Prepare(Connection& connection, const Run& run) {
  {
    const MutexLock lock(mutex_);
    if (!prepared_.insert(FindIn(run.stages, artifact::kColorizer).artifact->digest().sha256())
             .second) {
      return;
    }
  }
  v1::JobSpec nothing = run.job.spec();
  v1::CorrectColorsSpec* correct = nothing.mutable_colorize_scene()->mutable_correct_colors();
  correct->clear_corrections();
  correct->set_proposals(0);
  try {
    SubmitJob(connection, CorrectionOf(run.stages, nothing), {.priority = kPreparing});
  } catch (const std::exception&) {  // the first stroke takes longer
  }
}

Json Corrections::Describe(const std::string& name) {
  const std::shared_ptr<const Run> run = Open(name);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  Prepare(connection, *run);
  Json corrections = Json::array();
  for (const auto& correction : run->job.spec().colorize_scene().correct_colors().corrections()) {
    const std::string id = CorrectionId(correction);
    Json strokes = nullptr;
    if (correction.color().has_points()) {
      const fs::path file = files_.path() / ("strokes-" + id + ".json");
      strokes = Json::parse(BytesOf(connection, correction.color().points(), file),
                            nullptr,
                            /*allow_exceptions=*/false);
    }
    corrections.push_back({{"id", id},
                           {"view", correction.view()},
                           {"strokes", strokes.is_array() ? strokes : Json()}});
  }
  const bool has_sources = std::ranges::any_of(run->stages, [](const v1::Job& stage) {
    return std::ranges::any_of(stage.artifacts(), [](const v1::Artifact& artifact) {
      return artifact.name().starts_with(artifact::kProvenance);
    });
  });
  return {{"key", run->key_view},
          {"views", run->views->Facts()},
          {"has_sources", has_sources},
          {"tone", ToneJson(run->job.spec())},
          {"corrections", corrections}};
}

std::string Corrections::PhotoJpeg(const std::string& name, const std::string& view, int side) {
  const std::shared_ptr<const Run> run = Open(name);
  return run->views->Jpeg(run->views->Find(view), side);
}

std::string Corrections::MapPng(
    const std::string& name, const std::string& trial, Map map, const std::string& view, int side) {
  const std::shared_ptr<const Run> run = Open(name);
  run->views->Find(view);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  std::vector<v1::Job> jobs;
  if (trial.empty()) {
    jobs = run->stages;
  } else {
    jobs.push_back(GetJob(connection, ResourceName(trial, "jobs")));
    if (jobs[0].spec().scene() != run->job.spec().scene()) {
      throw InvalidArgument("{} belongs to another scene", jobs[0].name());
    }
  }
  const auto read = [&](const char* folder) -> std::optional<std::string> {
    const std::string artifact = folder + StemOf(view) + ".png";
    const Found found = FindIn(jobs, artifact);
    if (found.job == nullptr) return std::nullopt;
    return ReadArtifact(connection, *found.job, artifact);
  };
  std::optional<std::string> png;
  switch (map) {
    case Map::kColor:
      png = read(artifact::kCorrectedAb);
      if (!png) png = read(artifact::kViewsAb);
      if (png) png = SmallAbPng(*png, view, side > 0 ? side : SceneViews::kSidePx);
      break;
    case Map::kBase:
      png = read(artifact::kViewsAb);
      if (png) png = SmallAbPng(*png, view, side > 0 ? side : SceneViews::kSidePx);
      break;
    case Map::kSource:
      png = read(artifact::kCorrectedProvenance);
      if (!png) png = read(artifact::kProvenance);
      break;
    case Map::kPull:
      png = read(artifact::kPull);
      break;
  }
  if (!png) throw Error(ErrorCode::kNotFound, "there is no such map of {}", view);
  return *png;
}

v1::FurtherKeyView Corrections::Uploaded(Connection& connection,
                                         const Run& run,
                                         const nlohmann::json& stroke) {
  if (!stroke.is_object() || !stroke.contains("view") || !stroke["view"].is_string() ||
      !stroke.contains("strokes")) {
    throw InvalidArgument("a correction has a view and strokes");
  }
  v1::FurtherKeyView correction;
  correction.set_view(stroke["view"].get<std::string>());
  nlohmann::json points =
      run.views->CapturedStrokes(run.views->Find(correction.view()), stroke["strokes"]);
  if (const auto reach = stroke.find("reach"); reach != stroke.end() && *reach != 1) {
    for (nlohmann::json& point : points) point["reach"] = *reach;
  }
  const ScratchFolder scratch;
  KeyColorFlags flags;
  flags.hints = scratch.path() / "points.json";
  WriteFileAtomic(flags.hints, points.dump());
  *correction.mutable_color() = UploadKeyColor(connection, flags);
  return correction;
}

VersionChange Corrections::ReadChange(Connection& connection,
                                      const Run& run,
                                      const nlohmann::json& json) {
  VersionChange change = ReadVersionChange(json);
  if (const auto add = json.find("add"); add != json.end()) {
    change.add = Uploaded(connection, run, *add);
  }
  return change;
}

v1::Job Corrections::Try(const std::string& name, const nlohmann::json& json) {
  const std::shared_ptr<const Run> run = Open(name);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const VersionChange change = ReadChange(connection, *run, json);
  const v1::JobSpec whole = Changed(NewestSpec(VersionsOf(connection, run->job), run->job), change);
  if (whole.colorize_scene().correct_colors().corrections().empty()) {
    throw Error(ErrorCode::kFailedPrecondition, "no correction is left to show");
  }
  return SubmitJob(connection, CorrectionOf(run->stages, whole));
}

v1::Job Corrections::Change(const std::string& name, const nlohmann::json& json) {
  const std::shared_ptr<const Run> run = Open(name);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const VersionChange change = ReadChange(connection, *run, json);
  v1::Job submitted;
  {
    const MutexLock one_by_one(submitting_);
    const std::vector<v1::Job> versions = VersionsOf(connection, run->job);
    submitted = SubmitJob(connection, Changed(NewestSpec(versions, run->job), change));
    for (const v1::Job& version : versions) {
      if (IsFinished(version.state())) continue;
      CancelJob(connection, version.name());
    }
  }
  const MutexLock lock(mutex_);
  ++changes_;
  changed_.NotifyAll();
  return submitted;
}

void Corrections::Watch(const std::string& name,
                        const std::function<bool(const std::string&)>& send) {
  const std::shared_ptr<const Run> run = Open(name);
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  std::string last;
  auto sent = steady_clock::now();
  while (true) {
    connection.cancel().ThrowIfCancelled();
    int64_t seen = 0;
    {
      const MutexLock lock(mutex_);
      seen = changes_;
    }
    const std::string state = StateOf(VersionsOf(connection, run->job)).dump();
    const bool is_new = state != last;
    if (is_new || steady_clock::now() - sent >= kStillHere) {
      if (!send(is_new ? state : "")) return;
      last = state;
      sent = steady_clock::now();
    }
    const auto end = steady_clock::now() + kBetweenLooks;
    const MutexLock lock(mutex_);
    while (changes_ == seen && changed_.WaitUntil(mutex_, end)) {
    }
  }
}

}  // namespace color3d::client
