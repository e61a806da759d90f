#include "server/store/project_store.h"

#include <utility>

#include "server/base/service_error.h"

namespace color3d {
namespace {

SceneRecord WithPublicName(SceneRecord scene) {
  scene.name = PublicScene(scene.name);
  return scene;
}
JobRecord WithPublicName(JobRecord job) {
  job.scene = PublicScene(job.scene);
  return job;
}
ColorizerRecord WithPublicName(ColorizerRecord colorizer) {
  colorizer.scene = PublicScene(colorizer.scene);
  return colorizer;
}
template <typename Record>
std::vector<Record> WithPublicName(std::vector<Record> records) {
  for (Record& record : records) record = WithPublicName(std::move(record));
  return records;
}

}  // namespace

void ProjectStore::RequireOwn(const std::string& job) const {
  if (store_->GetJob(job).project == project_) return;
  throw ServiceError(ErrorReason::kJobNotFound, "there is no job '{}'", job);
}

RequestKey ProjectStore::Own(RequestKey request) const {
  if (!request.id.empty() && !project_.empty()) request.id += '@' + project_;
  return request;
}

std::string ProjectStore::Stored(const std::string& scene) const {
  if (PublicScene(scene) != scene) {
    throw ServiceError(ErrorReason::kSceneNotFound, "there is no scene '{}'", scene);
  }
  return StoredScene(scene, project_);
}

SceneRecord ProjectStore::CreateScene(SceneRecord record,
                                      const RequestKey& request,
                                      const SceneLimits& limits) const {
  record.name = Stored(record.name);
  record.project = project_;
  return WithPublicName(store_->CreateScene(record, Own(request), limits));
}

SceneRecord ProjectStore::GetScene(const std::string& name) const {
  return WithPublicName(store_->GetScene(Stored(name)));
}

std::vector<SceneRecord> ProjectStore::ListScenes(int64_t before_id, int limit) const {
  return WithPublicName(store_->ListScenes(project_, before_id, limit));
}

SceneRecord ProjectStore::ActivateScene(const std::string& name,
                                        CaptureLayout layout,
                                        int photo_count,
                                        const RequestKey& request) const {
  return WithPublicName(store_->ActivateScene(Stored(name), layout, photo_count, Own(request)));
}

SceneRecord ProjectStore::AcceptKeyColor(const std::string& name,
                                         const std::string& job,
                                         const RequestKey& request) const {
  if (!job.empty()) RequireOwn(job);
  return WithPublicName(store_->AcceptKeyColor(Stored(name), job, Own(request)));
}

void ProjectStore::DeleteScene(const std::string& name, const RequestKey& request) const {
  store_->DeleteScene(Stored(name), Own(request));
}

JobRecord ProjectStore::CreateGraph(NewGraph graph,
                                    const RequestKey& request,
                                    const QueueLimits& limits) const {
  graph.project = project_;
  graph.scene = Stored(graph.scene);
  for (NewJob& job : graph.jobs) {
    job.scene = Stored(job.scene);
    for (const std::string& input : job.input_jobs) RequireOwn(input);
  }
  return WithPublicName(store_->CreateGraph(graph, Own(request), limits));
}

std::optional<std::string> ProjectStore::FindRequest(const RequestKey& request) const {
  return store_->FindRequest(Own(request));
}

JobRecord ProjectStore::GetJob(const std::string& name) const {
  JobRecord job = store_->GetJob(name);
  if (job.project != project_) RequireOwn(name);
  return WithPublicName(std::move(job));
}

std::vector<JobRecord> ProjectStore::ListJobs(JobFilter filter,
                                              int64_t before_id,
                                              int limit,
                                              const ListBudget& budget) const {
  filter.project = project_;
  filter.scene = Stored(filter.scene);
  return WithPublicName(store_->ListJobs(filter, before_id, limit, budget));
}

std::vector<JobRecord> ProjectStore::ListChildren(const std::string& name) const {
  RequireOwn(name);
  return WithPublicName(store_->ListChildren(name));
}

std::vector<JobRecord> ProjectStore::GetInputs(const JobRecord& job) const {
  RequireOwn(job.name);
  return WithPublicName(store_->GetInputs(job.id));
}

JobRecord ProjectStore::Cancel(const std::string& name, const RequestKey& request) const {
  RequireOwn(name);
  return WithPublicName(store_->Cancel(name, Own(request)));
}

JobRecord ProjectStore::Retry(const std::string& name,
                              bool from_scratch,
                              const RequestKey& request,
                              const QueueLimits& limits) const {
  RequireOwn(name);
  return WithPublicName(store_->Retry(name, from_scratch, Own(request), limits));
}

void ProjectStore::Delete(const std::string& name, const RequestKey& request) const {
  // A repeated call no longer finds the deleted job, but its request id is known.
  if (!store_->FindRequest(Own(request))) RequireOwn(name);
  store_->Delete(name, Own(request));
}

JobRecord ProjectStore::Pin(const std::string& name, bool pinned) const {
  RequireOwn(name);
  return WithPublicName(store_->Pin(name, pinned));
}

JobsSnapshot ProjectStore::Snapshot(const std::vector<int64_t>& job_ids) const {
  JobsSnapshot snapshot = store_->Snapshot(job_ids);
  snapshot.jobs = WithPublicName(std::move(snapshot.jobs));
  return snapshot;
}

LoadedJobs ProjectStore::LoadJobs(const std::vector<int64_t>& job_ids,
                                  const ListBudget& budget) const {
  LoadedJobs loaded = store_->LoadJobs(job_ids, budget);
  loaded.jobs = WithPublicName(std::move(loaded.jobs));
  return loaded;
}

std::vector<int64_t> ProjectStore::ResolveWatch(const std::vector<std::string>& names) const {
  for (const std::string& name : names) RequireOwn(name);
  return store_->ResolveWatch(names);
}

std::vector<ColorizerRecord> ProjectStore::ListColorizers(const std::string& scene,
                                                          int64_t before_id,
                                                          int limit) const {
  return WithPublicName(store_->ListColorizers(project_, Stored(scene), before_id, limit));
}

ColorizerRecord ProjectStore::GetColorizer(const std::string& sha256) const {
  return WithPublicName(store_->GetColorizer(project_, sha256));
}

bool ProjectStore::HoldsBlob(const FileDigest& blob) const {
  return !HeldBlobs({blob.sha256}).empty();
}

}  // namespace color3d
