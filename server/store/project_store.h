// The store as seen by one project: its scenes, jobs, colorizers, blobs and request ids under their
// public names. Data of other projects does not exist here (kNotFound). All calls of clients go
// through this class. Cheap to copy; thread-safe like the store.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "server/store/client_store.h"

namespace color3d {

class ProjectStore {
 public:
  // The store must outlive this object. Empty `project`: the default project.
  ProjectStore(ClientStore& store, std::string project)
      : store_(&store), project_(std::move(project)) {}

  const std::string& project() const { return project_; }

  // See ClientStore.
  SceneRecord CreateScene(SceneRecord record,
                          const RequestKey& request,
                          const SceneLimits& limits) const;
  SceneRecord GetScene(const std::string& name) const;
  std::vector<SceneRecord> ListScenes(int64_t before_id, int limit) const;
  SceneRecord ActivateScene(const std::string& name,
                            CaptureLayout layout,
                            int photo_count,
                            const RequestKey& request) const;
  SceneRecord AcceptKeyColor(const std::string& name,
                             const std::string& job,
                             const RequestKey& request) const;
  void DeleteScene(const std::string& name, const RequestKey& request) const;

  JobRecord CreateGraph(NewGraph graph, const RequestKey& request, const QueueLimits& limits) const;
  std::optional<std::string> FindRequest(const RequestKey& request) const;
  JobRecord GetJob(const std::string& name) const;
  std::vector<JobRecord> ListJobs(JobFilter filter,
                                  int64_t before_id,
                                  int limit,
                                  const ListBudget& budget) const;
  // Returns jobs with artifacts, in order of creation.
  std::vector<JobRecord> ListChildren(const std::string& name) const;
  std::vector<JobRecord> GetInputs(const JobRecord& job) const;
  JobRecord Cancel(const std::string& name, const RequestKey& request) const;
  JobRecord Retry(const std::string& name,
                  bool from_scratch,
                  const RequestKey& request,
                  const QueueLimits& limits) const;
  void Delete(const std::string& name, const RequestKey& request) const;
  JobRecord Pin(const std::string& name, bool pinned) const;
  QueuePlace PlaceInQueue(const JobRecord& job) const { return store_->PlaceInQueue(job); }
  // See ClientStore::Snapshot. Requires: the ids are from ResolveWatch.
  JobsSnapshot Snapshot(const std::vector<int64_t>& job_ids) const;
  LoadedJobs LoadJobs(const std::vector<int64_t>& job_ids, const ListBudget& budget) const;
  // Returns the ids of the named jobs and of their children.
  std::vector<int64_t> ResolveWatch(const std::vector<std::string>& names) const;

  // Empty `scene`: all scenes.
  std::vector<ColorizerRecord> ListColorizers(const std::string& scene,
                                              int64_t before_id,
                                              int limit) const;
  ColorizerRecord GetColorizer(const std::string& sha256) const;

  void HoldBlob(const FileDigest& blob) const { store_->HoldBlob(project_, blob); }
  bool HoldsBlob(const FileDigest& blob) const;
  std::set<std::string> HeldBlobs(const std::vector<std::string>& sha256) const {
    return store_->HeldBlobs(project_, sha256);
  }
  ProjectRecord Usage() const { return store_->GetProject(project_); }

 private:
  // Throws JOB_NOT_FOUND for a job of another project.
  void RequireOwn(const std::string& job) const;
  RequestKey Own(RequestKey request) const;
  // Returns the stored name. Throws SCENE_NOT_FOUND for a name that has the form of a stored one.
  std::string Stored(const std::string& scene) const;

  ClientStore* store_;
  std::string project_;
};

}  // namespace color3d
