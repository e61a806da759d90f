#include "server/worker/attempt.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <map>
#include <thread>

#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/catalogue/artifacts.h"
#include "server/base/service_error.h"
#include "server/ops/process.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/stage_key.h"
#include "server/worker/attempt_trace.h"
#include "server/worker/blob_checkpoints.h"
#include "server/worker/stage_summaries.h"
#include "server/worker/told_paths.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Makes a file readable under another name: by a hard link, or by a copy across filesystems.
void LinkOrCopy(const fs::path& file, const fs::path& target) {
  fs::create_directories(target.parent_path());
  if (::link(file.c_str(), target.c_str()) == 0) return;
  fs::copy_file(file, target);
}

void LinkBlob(const WorkerBlobs& blobs, const std::string& sha256, const fs::path& target) {
  blobs.Borrow(sha256, [&](const fs::path& file) { LinkOrCopy(file, target); });
}

// Identity of a model file and of all files that are read with it.
std::string IdentityOf(const fs::path& model) {
  std::string identity;
  for (const fs::path& part : FilesOfModel(model)) {
    identity += part.filename().string() + ' ' + FileIdentity(part) + '\n';
  }
  return identity;
}

// Links the blobs into a folder of the attempt.
class LinkedBlobs : public BlobSource {
 public:
  LinkedBlobs(const WorkerBlobs& blobs, fs::path folder)
      : blobs_(blobs), folder_(std::move(folder)) {}
  fs::path Fetch(const std::string& sha256) override {
    const fs::path file = folder_ / sha256;
    std::error_code none;
    if (!fs::exists(file, none)) LinkBlob(blobs_, sha256, file);
    return file;
  }

 private:
  const WorkerBlobs& blobs_;
  const fs::path folder_;
};

class Attempt {
 public:
  Attempt(const AttemptContext& context, const JobRecord& job, bool shares_process)
      : context_(context),
        job_(job),
        tag_(AttemptTag(job)),
        trace_(context.tracer, job),
        scratch_(context.paths.Scratch() /
                 (job.name.substr(job.name.find('/') + 1) + "-" + std::to_string(job.lease_epoch))),
        keeper_(
            context.heartbeat_store,
            job,
            context.timing,
            context.draining,
            [this] { context_.on_heartbeat(job_); },
            [this](StopReason reason) { GiveUp(reason); }),
        checkpoints_(context.store, context.blobs, job, context.checkpoint_interval) {
    if (!shares_process) ResetPeakMemory();
  }
  ~Attempt() {
    std::error_code error;
    fs::remove_all(scratch_, error);
  }

  void Run();

 private:
  void Prepare();
  void NoteModels(const std::vector<std::string>& names);
  void RequireModelsUnchanged() const;
  bool ServeFromCache();
  // Returns true if the job was requeued because a running job does equal work.
  bool JoinEqual();
  void Compute();
  void Publish(const StageOutput& output);
  void HandleError(const JobError& found);
  JobError OutOfMemory(const std::exception& e) const;
  // Stores the end of an attempt that was asked to stop; returns false if it was not.
  void ReportEnd(WorkerStore& store, StopReason reason, const JobError& error);
  [[noreturn]] void GiveUp(StopReason reason);
  void LogEnd(const char* how);

  const AttemptContext& context_;
  const JobRecord job_;
  const std::string tag_;
  AttemptTrace trace_;
  const fs::path scratch_;
  StageRun run_;
  std::string stage_key_;
  std::map<std::string, ArtifactRecord> input_artifacts_;
  struct ModelFile {
    fs::path file;
    std::string identity;
    std::string digests;
  };
  std::map<std::string, ModelFile> models_;  // models named in the spec
  LeaseKeeper keeper_;
  BlobCheckpoints checkpoints_;
};

void Attempt::Run() {
  spdlog::info("{} begins {} of {}", tag_, job_.kind, job_.scene);
  try {
    trace_.InPart("read inputs", [&] { Prepare(); });
    if (!ServeFromCache() && !JoinEqual()) Compute();
  } catch (const Error& e) {
    // Exceptions of libraries become internal errors with their text.
    if (e.code() == ErrorCode::kInternal && IsOutOfMemory(e)) {
      HandleError(OutOfMemory(e));
    } else {
      HandleError({e.code(), ReasonOf(e), e.what()});
    }
  } catch (const fs::filesystem_error& e) {
    const bool full = e.code() == std::errc::no_space_on_device;
    HandleError(full ? MakeJobError(ErrorReason::kStorageFull,
                                    std::string(e.what()) + "; free some disk space")
                     : JobError{ErrorCode::kInternal, "", e.what()});
  } catch (const std::exception& e) {
    HandleError(IsOutOfMemory(e)
                    ? OutOfMemory(e)
                    : JobError{ErrorCode::kInternal, "", std::string("unexpected: ") + e.what()});
  }
  trace_.End(keeper_.Usage());
}

JobError Attempt::OutOfMemory(const std::exception& e) const {
  spdlog::warn("{} ran out of memory at {} MiB ({}): {}",
               tag_,
               OwnMemoryBytes() >> 20,
               MemoryRemedy(),
               e.what());
  return MakeJobError(
      ErrorReason::kOutOfMemory,
      fmt::format("{} ran out of memory; use fewer or smaller pictures (max_side_px), or {}",
                  job_.kind,
                  MemoryRemedy()));
}

void Attempt::Prepare() {
  fs::remove_all(scratch_);
  run_.job_name = job_.name;
  run_.project = job_.project;
  run_.spec = ParseSpec(job_.spec, job_.name);
  run_.threads = context_.threads;
  run_.traceparent = trace_.traceparent();
  run_.attempt = job_.attempt;
  run_.models = context_.models;
  run_.scene_folder = scratch_ / "scene";
  run_.output_folder = scratch_ / "out";
  run_.scratch_folder = scratch_ / "tmp";
  run_.cache_folder = context_.paths.Cache();
  for (const fs::path& folder : {run_.scene_folder, run_.output_folder, run_.scratch_folder}) {
    fs::create_directories(folder);
  }
  std::string manifest;
  for (const SceneFileRecord& file : context_.store.GetScene(job_.scene).files) {
    LinkBlob(context_.blobs, file.digest.sha256, run_.scene_folder / file.path);
    manifest += file.path + '\n' + file.digest.sha256 + '\n';
    keeper_.token().ThrowIfCancelled();
  }
  int additional_key_views = 0;
  for (const JobRecord& input : context_.store.GetInputs(job_.id)) {
    // Their artifacts have the same names as those of the first key view.
    std::string folder;
    if (ColorsAdditionalKeyView(ParseSpec(input.spec, input.name))) {
      folder = fmt::format("{}{}/", artifact::kKeyViews, ++additional_key_views);
    }
    for (ArtifactRecord artifact : input.artifacts) {
      artifact.name = folder + artifact.name;
      if (!input_artifacts_.emplace(artifact.name, artifact).second) continue;
      const fs::path path = scratch_ / "inputs" / artifact.name;
      LinkBlob(context_.blobs, artifact.digest.sha256, path);
      // Rendered views are stored in place of photos.
      if (artifact.name.starts_with(artifact::kGivenViews)) {
        LinkOrCopy(path, run_.scene_folder / artifact.name);
      }
      run_.inputs[artifact.name] = path;
    }
  }
  run_.graph = SummarizeStages(context_.store.ListChildren(job_.name),
                               SceneFactsFrom(context_.store.GetScene(job_.scene)));
  const StageKeyPart part = KeyPartOf(run_.spec);
  NoteModels(part.models);
  if (part.bytes.empty()) return;
  // The key includes the project, which must not learn of equal work of others.
  std::string material =
      context_.code_version + '\n' + job_.project + '\n' + Sha256Hex(manifest) + '\n';
  for (const auto& [name, artifact] : input_artifacts_) {
    material += name + '\n' + artifact.digest.sha256 + '\n';
  }
  // The key includes digests of weights, because a name may get new ones, and addresses of
  // backends, whose computation is unknown.
  for (const std::string& name : part.models) material += models_.at(name).digests;
  for (const std::string& name : part.backends) {
    const auto address = context_.models.backends.find(name);
    if (address != context_.models.backends.end()) material += address->second + '\n';
  }
  stage_key_ = Sha256Hex(material + part.bytes);
}

void Attempt::NoteModels(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const auto file = context_.models.files.find(name);
    if (file == context_.models.files.end()) {
      throw Error(
          ErrorCode::kFailedPrecondition,
          "{} needs the model '{}', which this server does not have (it has: {}); start the server "
          "with --model {}=FILE and retry the job",
          job_.kind,
          name,
          NamesOf(context_.models.files),
          name);
    }
    std::error_code none;
    if (!fs::is_regular_file(file->second, none)) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "the file of the model '{}' ({}) is missing; restore it and retry the job",
                  name,
                  file->second.string());
    }
    ModelFile& model = models_[name];
    model.file = file->second;
    model.identity = IdentityOf(file->second);
    model.digests = DigestsOfModel(file->second, context_.digests);
    keeper_.token().ThrowIfCancelled();
  }
}

// The stage may have read the files after a change.
void Attempt::RequireModelsUnchanged() const {
  for (const auto& [name, model] : models_) {
    if (IdentityOf(model.file) == model.identity) continue;
    throw ServiceError(ErrorReason::kModelChanged,
                       "the file of the model '{}' ({}) was replaced while {} ran; retry the job",
                       name,
                       model.file.string(),
                       job_.kind);
  }
}

bool Attempt::ServeFromCache() {
  if (run_.spec.skip_cache()) return false;
  const std::optional<JobRecord> earlier = context_.store.FindStage(stage_key_);
  if (!earlier) return false;
  for (const ArtifactRecord& artifact : earlier->artifacts) {
    if (!context_.blobs.Touch(artifact.digest)) return false;
  }
  keeper_.Stop();
  if (keeper_.stop_reason() != StopReason::kNone) keeper_.token().ThrowIfCancelled();
  Publication publication;
  publication.artifacts = earlier->artifacts;
  publication.stage_key = stage_key_;
  publication.cached = true;
  publication.usage = earlier->usage;
  context_.store.Publish(keeper_.lease(), publication);
  trace_.SetOutcome("cached");
  spdlog::info("{} served from the stage cache ({})", tag_, earlier->name);
  return true;
}

bool Attempt::JoinEqual() {
  if (run_.spec.skip_cache() || stage_key_.empty()) return false;
  if (!context_.store.JoinEqual(keeper_.lease(), stage_key_)) return false;
  keeper_.Stop();
  trace_.SetOutcome("waits for equal work");
  spdlog::info("{} waits for a job that does equal work", tag_);
  return true;
}

void Attempt::Compute() {
  LinkedBlobs blobs(context_.blobs, scratch_ / "blobs");
  const StageOutput output = trace_.InPart("run", [&] {
    return context_.runner.Run(run_, blobs, checkpoints_, keeper_, keeper_.token());
  });
  RequireModelsUnchanged();
  trace_.InPart("publish", [&] { Publish(output); });
}

void Attempt::Publish(const StageOutput& output) {
  Publication publication;
  for (const std::string& name : output.passed_on) {
    const auto artifact = input_artifacts_.find(name);
    if (artifact == input_artifacts_.end()) {
      throw Error(ErrorCode::kInternal, "{} passes on '{}', which no input has", job_.kind, name);
    }
    publication.artifacts.push_back(artifact->second);
  }
  for (const std::string& name : output.files) {
    const fs::path file = run_.output_folder / name;
    std::error_code error;
    if (!IsSafeRelativePath(name) || !fs::is_regular_file(fs::symlink_status(file, error))) {
      throw Error(ErrorCode::kInternal,
                  "{} lists the result '{}', which is not a file in its output folder",
                  job_.kind,
                  name);
    }
    context_.blobs.RequireSpace(0);
    publication.artifacts.push_back({name, context_.blobs.PutFile(file), MediaTypeOf(name)});
    if (keeper_.stop_reason() == StopReason::kLeaseLost) keeper_.token().ThrowIfCancelled();
  }
  // Touched, so that no sweep removes them before they are named.
  for (const ArtifactRecord& artifact : publication.artifacts) {
    if (context_.blobs.Touch(artifact.digest)) continue;
    throw ServiceError(
        ErrorCode::kUnavailable,
        ErrorReason::kBlobMissing,
        "the result {} of {} disappeared from the blob store before it was published",
        artifact.name,
        job_.kind);
  }
  publication.stage_key = stage_key_;
  publication.usage = keeper_.Usage();
  keeper_.Stop();  // a heartbeat after the end would look like a lost lease
  context_.store.Publish(keeper_.lease(), publication);
  checkpoints_.RemoveNewest();
  trace_.SetOutcome("succeeded");
  LogEnd("succeeded");
}

void Attempt::LogEnd(const char* how) {
  const JobUsage usage = keeper_.Usage();
  spdlog::info("{} {} after {:.1f} s, peak memory {} MiB, now {} MiB",
               tag_,
               how,
               usage.seconds,
               usage.peak_memory_bytes >> 20,
               ResidentMemoryBytes() >> 20);
}

void Attempt::HandleError(const JobError& found) {
  const JobError error{
      found.code,
      found.reason,
      WithoutFolders(found.message, {run_.scene_folder, scratch_, context_.paths.root})};
  if (error.message != found.message) spdlog::warn("{} {}", tag_, found.message);
  keeper_.Stop();
  // The stage may learn of a lost lease (saving a checkpoint) before the heartbeat does.
  const bool lost = error.reason == ErrorReasonName(ErrorReason::kLeaseLost);
  // Frees space first: on a full disk the store could not even record the failure.
  std::error_code ignored;
  fs::remove_all(scratch_, ignored);
  for (int tries_left = 2;; --tries_left) {
    try {
      return ReportEnd(
          context_.store, lost ? StopReason::kLeaseLost : keeper_.stop_reason(), error);
    } catch (const Error& e) {
      if (tries_left > 0 && e.code() != ErrorCode::kAborted) {
        std::this_thread::sleep_for(context_.timing.report_pause);
        continue;
      }
      spdlog::error("{} cannot store its outcome ({}); its lease will expire", tag_, e.what());
      return;
    }
  }
}

void Attempt::ReportEnd(WorkerStore& store, StopReason reason, const JobError& error) {
  const JobUsage usage = keeper_.Usage();
  trace_.SetOutcome(reason, error);
  switch (reason) {
    case StopReason::kLeaseLost:
      spdlog::warn("{} lost its lease; nothing is published", tag_);
      return;
    case StopReason::kCancelled:
      store.Fail(keeper_.lease(), {ErrorCode::kCancelled, "", "cancelled"}, usage);
      return LogEnd("was cancelled");
    case StopReason::kDraining:
      store.Release(keeper_.lease(), usage);
      return LogEnd("was released for another worker");
    case StopReason::kStuck:
      store.Fail(keeper_.lease(),
                 MakeJobError(ErrorReason::kStageStuck,
                              fmt::format("{} made no progress for {} s",
                                          job_.kind,
                                          context_.timing.stuck.count() / 1000)),
                 usage);
      return LogEnd("was stuck");
    case StopReason::kNone:
      break;
  }
  spdlog::error("{} failed: {}: {}", tag_, ErrorCodeName(error.code), error.message);
  store.Fail(keeper_.lease(), error, usage);
  LogEnd("failed");
}

// The stage ignores the token: ends the attempt in the store, then the process, because a hanging
// thread cannot be ended alone.
void Attempt::GiveUp(StopReason reason) {
  try {
    ReportEnd(context_.heartbeat_store, reason, {});
  } catch (const Error& e) {
    spdlog::error("{} cannot report its end: {}", tag_, e.what());
  }
  spdlog::critical("{} does not stop; the worker process ends with it", tag_);
  trace_.EndProcess(keeper_.Usage());
  spdlog::shutdown();
  ::_exit(3);
}

}  // namespace

void ReturnJob(WorkerStore& store, const JobRecord& job) {
  try {
    store.Release({job.id, job.lease_epoch}, job.usage);
  } catch (const std::exception& e) {
    spdlog::error("{} cannot be requeued; its lease will expire: {}", AttemptTag(job), e.what());
  }
}

void RunAttempt(const AttemptContext& context, const JobRecord& job, bool shares_process) {
  try {
    Attempt attempt(context, job, shares_process);
    attempt.Run();
  } catch (const std::exception& e) {
    // The attempt did not start or its end could not be stored: not a failure of the job.
    spdlog::error("{} could not be run here: {}", AttemptTag(job), e.what());
    std::this_thread::sleep_for(context.timing.report_pause);
    ReturnJob(context.store, job);
  }
  ReleaseFreedMemory();
}

}  // namespace color3d
