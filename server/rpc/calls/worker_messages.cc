#include "server/rpc/calls/worker_messages.h"

#include "core/base/text/utf8.h"
#include "server/base/service_error.h"

namespace color3d {
namespace wire = internal::v1;

void RequireWorkerProtocol(int32_t server,
                           int32_t worker,
                           const std::string& server_release,
                           const std::string& worker_release) {
  if (worker == server || worker == server - 1) return;
  throw ServiceError(
      ErrorReason::kWorkerVersion,
      "this worker is of version '{}' and speaks protocol {}; the server is of version '{}' and "
      "takes workers of protocol {} or {}; install {}",
      worker_release.substr(0, 40),
      worker,
      server_release,
      server - 1,
      server,
      worker < server ? "the server's version of color3d-worker"
                      : "the worker's version of the "
                        "server");
}

wire::Digest ToWire(const FileDigest& digest) {
  wire::Digest message;
  message.set_sha256(digest.sha256);
  message.set_size_bytes(digest.size_bytes);
  return message;
}

FileDigest FromWire(const wire::Digest& digest) { return {digest.sha256(), digest.size_bytes()}; }

wire::Lease ToWire(const Lease& lease) {
  wire::Lease message;
  message.set_job_id(lease.job_id);
  message.set_epoch(lease.epoch);
  return message;
}

Lease FromWire(const wire::Lease& lease) { return {lease.job_id(), lease.epoch()}; }

wire::Artifact ToWire(const ArtifactRecord& artifact) {
  wire::Artifact message;
  message.set_name(artifact.name);
  *message.mutable_digest() = ToWire(artifact.digest);
  message.set_media_type(artifact.media_type);
  return message;
}

ArtifactRecord FromWire(const wire::Artifact& artifact) {
  return {artifact.name(), FromWire(artifact.digest()), artifact.media_type()};
}

wire::Progress ToWire(const ProgressRecord& progress) {
  wire::Progress message;
  message.set_step(progress.step);
  message.set_total_steps(progress.total_steps);
  message.set_message(CleanUtf8(progress.message));
  message.set_error_name(CleanUtf8(progress.error_name));
  message.set_error_value(progress.error_value);
  message.set_eta_seconds(progress.eta_seconds);
  return message;
}

ProgressRecord FromWire(const wire::Progress& progress) {
  return {progress.step(),
          progress.total_steps(),
          progress.message(),
          progress.error_name(),
          progress.error_value(),
          progress.eta_seconds()};
}

wire::Usage ToWire(const JobUsage& usage) {
  wire::Usage message;
  message.set_seconds(usage.seconds);
  message.set_peak_memory_bytes(usage.peak_memory_bytes);
  for (const std::string& warning : usage.warnings) message.add_warnings(CleanUtf8(warning));
  return message;
}

JobUsage FromWire(const wire::Usage& usage) {
  return {usage.seconds(),
          usage.peak_memory_bytes(),
          {usage.warnings().begin(), usage.warnings().end()}};
}

wire::JobError ToWire(const JobError& error) {
  wire::JobError message;
  message.set_code(static_cast<int32_t>(error.code));
  message.set_reason(error.reason);
  message.set_message(CleanUtf8(error.message));
  return message;
}

JobError FromWire(const wire::JobError& error) {
  const bool known =
      error.code() >= 0 && error.code() <= static_cast<int32_t>(ErrorCode::kPermissionDenied);
  return {known ? static_cast<ErrorCode>(error.code()) : ErrorCode::kInternal,
          error.reason(),
          error.message()};
}

wire::Job ToWire(const JobRecord& job) {
  wire::Job message;
  message.set_id(job.id);
  message.set_name(job.name);
  message.set_parent(job.parent);
  message.set_kind(job.kind);
  message.set_scene(job.scene);
  message.set_spec(job.spec);
  message.set_project(job.project);
  message.set_state(JobStateName(job.state));
  message.set_cancel_requested(job.cancel_requested);
  message.set_priority(job.priority);
  message.set_attempt(job.attempt);
  message.set_max_attempts(job.max_attempts);
  message.set_lease_epoch(job.lease_epoch);
  *message.mutable_progress() = ToWire(job.progress);
  *message.mutable_usage() = ToWire(job.usage);
  for (const ArtifactRecord& artifact : job.artifacts) *message.add_artifacts() = ToWire(artifact);
  if (job.error) *message.mutable_error() = ToWire(*job.error);
  message.set_skip_reason(CleanUtf8(job.skip_reason));
  message.set_skipped_by_plan(job.skipped_by_plan);
  message.set_cached(job.cached);
  message.set_trace(job.trace);
  if (job.checkpoint) *message.mutable_checkpoint() = ToWire(*job.checkpoint);
  message.set_worker(job.worker);
  message.set_queued_ms(job.queued_ms);
  message.set_create_ms(job.create_ms);
  message.set_start_ms(job.start_ms);
  message.set_batch_group(job.needs.batch_group);
  message.set_end_ms(job.end_ms);
  return message;
}

JobRecord FromWire(const wire::Job& job) {
  JobRecord record;
  record.id = job.id();
  record.name = job.name();
  record.parent = job.parent();
  record.kind = job.kind();
  record.scene = job.scene();
  record.spec = job.spec();
  record.project = job.project();
  record.state = JobStateFromName(job.state());
  record.cancel_requested = job.cancel_requested();
  record.priority = job.priority();
  record.attempt = job.attempt();
  record.max_attempts = job.max_attempts();
  record.lease_epoch = job.lease_epoch();
  record.progress = FromWire(job.progress());
  record.usage = FromWire(job.usage());
  for (const wire::Artifact& artifact : job.artifacts()) {
    record.artifacts.push_back(FromWire(artifact));
  }
  if (job.has_error()) record.error = FromWire(job.error());
  record.skip_reason = job.skip_reason();
  record.skipped_by_plan = job.skipped_by_plan();
  record.cached = job.cached();
  record.trace = job.trace();
  if (job.has_checkpoint()) record.checkpoint = FromWire(job.checkpoint());
  record.worker = job.worker();
  record.queued_ms = job.queued_ms();
  record.create_ms = job.create_ms();
  record.start_ms = job.start_ms();
  record.end_ms = job.end_ms();
  record.needs.batch_group = job.batch_group();
  return record;
}

wire::Scene ToWire(const SceneRecord& scene) {
  wire::Scene message;
  message.set_id(scene.id);
  message.set_name(scene.name);
  message.set_project(scene.project);
  message.set_display_name(scene.display_name);
  message.set_active(scene.state == SceneState::kActive);
  message.set_layout(static_cast<int32_t>(scene.layout));
  message.set_photo_count(scene.photo_count);
  for (const SceneFileRecord& file : scene.files) {
    wire::SceneFile* entry = message.add_files();
    entry->set_path(file.path);
    *entry->mutable_digest() = ToWire(file.digest);
  }
  message.set_key_color_job(scene.key_color_job);
  message.set_create_ms(scene.create_ms);
  message.set_commit_ms(scene.commit_ms);
  return message;
}

SceneRecord FromWire(const wire::Scene& scene) {
  SceneRecord record;
  record.id = scene.id();
  record.name = scene.name();
  record.project = scene.project();
  record.display_name = scene.display_name();
  record.state = scene.active() ? SceneState::kActive : SceneState::kUploading;
  record.layout = static_cast<CaptureLayout>(scene.layout());
  record.photo_count = scene.photo_count();
  for (const wire::SceneFile& file : scene.files()) {
    record.files.push_back({file.path(), FromWire(file.digest())});
  }
  record.key_color_job = scene.key_color_job();
  record.create_ms = scene.create_ms();
  record.commit_ms = scene.commit_ms();
  return record;
}

wire::Worker ToWire(const WorkerRecord& worker) {
  wire::Worker message;
  message.set_worker_id(worker.worker_id);
  message.set_pid(worker.pid);
  message.set_job(worker.job);
  message.set_memory_bytes(worker.memory_bytes);
  message.set_heartbeat_ms(worker.heartbeat_ms);
  message.set_machine(worker.machine);
  message.set_release(worker.release);
  message.set_threads(worker.threads);
  message.set_memory_limit_bytes(worker.memory_limit_bytes);
  message.set_simd(worker.simd);
  message.set_cache_bytes(worker.cache_bytes);
  message.set_cache_limit_bytes(worker.cache_limit_bytes);
  message.set_cache_hit_bytes(worker.cache_hit_bytes);
  message.set_cache_miss_bytes(worker.cache_miss_bytes);
  message.set_finished_jobs(worker.finished_jobs);
  return message;
}

WorkerRecord FromWire(const wire::Worker& worker) {
  WorkerRecord record;
  record.worker_id = worker.worker_id();
  record.pid = worker.pid();
  record.job = worker.job();
  record.memory_bytes = worker.memory_bytes();
  record.heartbeat_ms = worker.heartbeat_ms();
  record.machine = worker.machine();
  record.release = worker.release();
  record.threads = worker.threads();
  record.memory_limit_bytes = worker.memory_limit_bytes();
  record.simd = worker.simd();
  record.cache_bytes = worker.cache_bytes();
  record.cache_limit_bytes = worker.cache_limit_bytes();
  record.cache_hit_bytes = worker.cache_hit_bytes();
  record.cache_miss_bytes = worker.cache_miss_bytes();
  record.finished_jobs = worker.finished_jobs();
  return record;
}

wire::ClaimRequest ToWire(const ClaimTerms& terms) {
  wire::ClaimRequest message;
  message.set_worker(terms.worker);
  message.set_lease_ms(terms.lease_ms);
  message.set_memory_limit_bytes(terms.memory_limit_bytes);
  message.set_batch_kind(terms.batch_kind);
  message.set_batch_group(terms.batch_group);
  message.set_lists_models(terms.models.has_value());
  if (terms.models) {
    for (const std::string& model : *terms.models) message.add_models(model);
  }
  return message;
}

ClaimTerms FromWire(const wire::ClaimRequest& request) {
  ClaimTerms terms{.worker = request.worker(),
                   .lease_ms = request.lease_ms(),
                   .memory_limit_bytes = request.memory_limit_bytes(),
                   .models = {},
                   .batch_kind = request.batch_kind(),
                   .batch_group = request.batch_group()};
  if (request.lists_models())
    terms.models.emplace(request.models().begin(), request.models().end());
  return terms;
}

wire::StoredBlob ToWire(const StoredBlob& blob) {
  wire::StoredBlob message;
  *message.mutable_digest() = ToWire(blob.digest);
  message.set_touched_ns(blob.touched_ns);
  return message;
}

StoredBlob FromWire(const wire::StoredBlob& blob) {
  return {FromWire(blob.digest()), blob.touched_ns()};
}

wire::GreetResponse ToWire(const WorkerTimes& times) {
  wire::GreetResponse message;
  message.set_protocol(kWorkerProtocol);
  message.set_lease_ms(times.lease_ms);
  message.set_heartbeat_ms(times.heartbeat_ms);
  message.set_checkpoint_ms(times.checkpoint_ms);
  message.set_stuck_ms(times.stuck_ms);
  return message;
}

WorkerTimes FromWire(const wire::GreetResponse& greeting) {
  return {
      greeting.lease_ms(), greeting.heartbeat_ms(), greeting.checkpoint_ms(), greeting.stuck_ms()};
}

}  // namespace color3d
