#include "server/worker/remote/remote_store.h"

namespace color3d {
namespace wire = internal::v1;
using Stub = WorkerLink::Stub;
namespace {

wire::Name NameOf(const std::string& name) {
  wire::Name message;
  message.set_name(name);
  return message;
}

std::vector<JobRecord> JobsOf(const wire::Jobs& message) {
  std::vector<JobRecord> jobs;
  for (const wire::Job& job : message.jobs()) jobs.push_back(FromWire(job));
  return jobs;
}

}  // namespace

SceneRecord RemoteStore::GetScene(const std::string& name) {
  return FromWire(link_.Retry(&Stub::GetScene, NameOf(name)));
}

JobRecord RemoteStore::GetJob(const std::string& name) {
  return FromWire(link_.Retry(&Stub::GetJob, NameOf(name)));
}

std::vector<JobRecord> RemoteStore::GetInputs(int64_t job_id) {
  wire::GetInputsRequest request;
  request.set_job_id(job_id);
  return JobsOf(link_.Retry(&Stub::GetInputs, request));
}

std::vector<JobRecord> RemoteStore::ListChildren(const std::string& name) {
  return JobsOf(link_.Retry(&Stub::ListChildren, NameOf(name)));
}

bool RemoteStore::IsReferenced(const std::string& sha256) {
  wire::LookBlobRequest request;
  request.set_sha256(sha256);
  return link_.Retry(&Stub::IsReferenced, request).referenced();
}

std::vector<WorkerRecord> RemoteStore::ListWorkers() {
  std::vector<WorkerRecord> workers;
  const wire::Workers message = link_.Retry(&Stub::ListWorkers, wire::Done());
  for (const wire::Worker& worker : message.workers()) workers.push_back(FromWire(worker));
  return workers;
}

void RemoteStore::RemoveWorker(const std::string& worker_id) {
  link_.Once(&Stub::RemoveWorker, NameOf(worker_id));
}

std::optional<JobRecord> RemoteStore::Claim(const ClaimTerms& terms) {
  wire::ClaimRequest request = ToWire(terms);
  request.set_protocol(protocol_);
  request.set_release(release_);
  const wire::ClaimResponse response = link_.Once(&Stub::Claim, request);
  if (!response.has_job()) return std::nullopt;
  return FromWire(response.job());
}

HeartbeatReply RemoteStore::Heartbeat(const Lease& lease,
                                      const ProgressRecord& progress,
                                      const JobUsage& usage,
                                      int64_t lease_ms) {
  wire::HeartbeatRequest request;
  *request.mutable_lease() = ToWire(lease);
  *request.mutable_progress() = ToWire(progress);
  *request.mutable_usage() = ToWire(usage);
  request.set_lease_ms(lease_ms);
  return {link_.Once(&Stub::Heartbeat, request).cancel_requested()};
}

HeartbeatReply RemoteStore::Peek(const Lease& lease) {
  return {link_.Once(&Stub::Peek, ToWire(lease)).cancel_requested()};
}

std::optional<FileDigest> RemoteStore::SetCheckpoint(const Lease& lease, const FileDigest& blob) {
  wire::SetCheckpointRequest request;
  *request.mutable_lease() = ToWire(lease);
  *request.mutable_blob() = ToWire(blob);
  const wire::SetCheckpointResponse response = link_.Retry(&Stub::SetCheckpoint, request);
  if (!response.has_replaced()) return std::nullopt;
  return FromWire(response.replaced());
}

bool RemoteStore::JoinEqual(const Lease& lease, const std::string& stage_key) {
  wire::JoinEqualRequest request;
  *request.mutable_lease() = ToWire(lease);
  request.set_stage_key(stage_key);
  return link_.Retry(&Stub::JoinEqual, request).joined();
}

void RemoteStore::Publish(const Lease& lease, const Publication& publication) {
  wire::PublishRequest request;
  *request.mutable_lease() = ToWire(lease);
  for (const ArtifactRecord& artifact : publication.artifacts) {
    *request.add_artifacts() = ToWire(artifact);
  }
  request.set_stage_key(publication.stage_key);
  request.set_cached(publication.cached);
  *request.mutable_usage() = ToWire(publication.usage);
  link_.Retry(&Stub::Publish, request);
}

void RemoteStore::Fail(const Lease& lease, const JobError& error, const JobUsage& usage) {
  wire::FailRequest request;
  *request.mutable_lease() = ToWire(lease);
  *request.mutable_error() = ToWire(error);
  *request.mutable_usage() = ToWire(usage);
  link_.RetryBriefly(&Stub::Fail, request);
}

void RemoteStore::Release(const Lease& lease, const JobUsage& usage) {
  wire::ReleaseRequest request;
  *request.mutable_lease() = ToWire(lease);
  *request.mutable_usage() = ToWire(usage);
  link_.RetryBriefly(&Stub::Release, request);
}

std::optional<JobRecord> RemoteStore::FindStage(const std::string& stage_key) {
  if (stage_key.empty()) return std::nullopt;
  wire::FindStageRequest request;
  request.set_stage_key(stage_key);
  const std::vector<JobRecord> jobs = JobsOf(link_.Retry(&Stub::FindStage, request));
  if (jobs.empty()) return std::nullopt;
  return jobs.front();
}

void RemoteStore::UpdateWorker(const WorkerRecord& worker) {
  link_.Once(&Stub::UpdateWorker, ToWire(worker));
}

}  // namespace color3d
