// The part of the job store that clients call: users through their ProjectStore, operators, and the
// server's metrics on their behalf (errors and threads: common_store.h).
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/store/common_store.h"

namespace color3d {

// Makes a mutating call idempotent: a call with the same id and body returns the result of the
// first one. An empty id switches this off.
struct RequestKey {
  std::string method;
  std::string id;
  std::string body_sha256;
};

struct NewJob {
  std::string kind;
  std::string scene;  // stored; empty: the graph's
  std::string spec;
  std::vector<int> inputs;              // positions in NewGraph::jobs, all smaller than its own
  std::vector<std::string> input_jobs;  // names of jobs that exist
  std::vector<std::string> blobs;       // digests that the spec names; kept alive with the job
  std::string skip_reason;              // not empty: the plan leaves it out
};

// The submitted job is the last one; all others become its children.
struct NewGraph {
  std::string project;
  std::string scene;  // stored
  std::string notify_url;
  std::string trace;  // of the call that made it, for logs; may be empty
  int priority = 100;
  std::vector<NewJob> jobs;
};

// Maximum numbers of unfinished jobs.
struct QueueLimits {
  QueueLimits(int64_t of_all, int64_t of_one_project = INT64_MAX)  // NOLINT: a number is one
      : all(of_all), of_project(of_one_project) {}
  int64_t all;
  int64_t of_project;
};

// Maximum numbers of scenes of a project.
struct SceneLimits {
  int64_t all = INT64_MAX;
  int64_t uncommitted = INT64_MAX;
};

struct JobFilter {
  std::string parent;                  // "jobs/..."
  std::string scene;                   // stored
  std::optional<std::string> project;  // nothing: all
};

// Maximum memory of a list of jobs.
struct ListBudget {
  int64_t bytes = INT64_MAX;       // the list ends with the job that reaches it (MemoryBytes)
  int64_t spec_bytes = INT64_MAX;  // a longer spec is left empty
};

// Reasons to give workers no job.
enum class Hold {
  kPaused,   // by the operator
  kStorage,  // the disk is nearly full
};

// The place of a waiting job in the queue.
struct QueuePlace {
  int64_t position = 0;   // 1: the next; 0: it does not wait for a worker
  std::string waits_for;  // empty: for its turn
};

enum class EventKind { kState, kProgress };

struct EventRecord {
  int64_t revision = 0;
  int64_t job_id = 0;
  EventKind kind = EventKind::kState;
  JobState state = JobState::kBlocked;  // at the time of the event
  int attempt = 0;
  int64_t time_ms = 0;
};

// The present state of some jobs and the newest revision of the store, read in one transaction.
struct JobsSnapshot {
  std::vector<JobRecord> jobs;  // by revision, oldest first; without spec and artifacts
  int64_t revision = 0;
};

// The requested jobs, as far as the budget goes.
struct LoadedJobs {
  std::vector<JobRecord> jobs;
  // Number of ids that were looked for; those that are not in `jobs` were deleted.
  size_t looked_for = 0;
};

struct ColorizerRecord {
  int64_t id = 0;  // of the job, for paging
  std::string job;
  std::string scene;
  FileDigest digest;
  int64_t create_ms = 0;
};

struct JobCounts {
  int64_t queued = 0;  // includes blocked
  int64_t running = 0;
  int64_t blocked = 0;  // wait for inputs
  // When the first of the jobs that wait for a worker began to wait; 0: none does.
  int64_t oldest_queued_ms = 0;
  int64_t notifications = 0;  // not delivered yet
};

class ClientStore : public virtual CommonStore {
 public:
  // Scenes. `record.name` must be set; its id and times are not read. kResourceExhausted
  // (QUOTA_EXCEEDED) when the project would have more scenes than `limits` allow.
  virtual SceneRecord CreateScene(const SceneRecord& record,
                                  const RequestKey& request,
                                  const SceneLimits& limits) = 0;
  // Newest first, ids below `before_id` (0: from the newest); of a project, or of all.
  virtual std::vector<SceneRecord> ListScenes(const std::optional<std::string>& project,
                                              int64_t before_id,
                                              int limit) = 0;
  virtual SceneRecord ActivateScene(const std::string& name,
                                    CaptureLayout layout,
                                    int photo_count,
                                    const RequestKey& request) = 0;
  // `job`: a colorize_key_view job of this scene that has succeeded, or empty to take it back.
  // kNotFound, kInvalidArgument or kFailedPrecondition otherwise.
  virtual SceneRecord AcceptKeyColor(const std::string& name,
                                     const std::string& job,
                                     const RequestKey& request) = 0;
  // Refused while a job of the scene is not finished; its finished jobs stay.
  virtual void DeleteScene(const std::string& name, const RequestKey& request) = 0;

  // Jobs.
  // Creates all jobs of the graph or none. kResourceExhausted (QUEUE_FULL, QUOTA_EXCEEDED) when
  // more jobs than `limits` allow would wait or run.
  virtual JobRecord CreateGraph(const NewGraph& graph,
                                const RequestKey& request,
                                const QueueLimits& limits) = 0;
  // The job made by an earlier equal request: a repeated call skips planning.
  virtual std::optional<std::string> FindRequest(const RequestKey& request) = 0;
  // Newest first, ids below `before_id` (0: from the newest).
  virtual std::vector<JobRecord> ListJobs(const JobFilter& filter,
                                          int64_t before_id,
                                          int limit,
                                          const ListBudget& budget) = 0;
  virtual JobRecord Cancel(const std::string& name, const RequestKey& request) = 0;
  // Retries the jobs of the graph that failed, were cancelled or were skipped for that.
  // kFailedPrecondition (INPUT_DELETED) when an input was deleted; full queues as CreateGraph.
  virtual JobRecord Retry(const std::string& name,
                          bool from_scratch,
                          const RequestKey& request,
                          const QueueLimits& limits) = 0;
  virtual void Delete(const std::string& name, const RequestKey& request) = 0;
  // Ends the job and its children as CANCELLED now: later writes of their workers are refused.
  virtual JobRecord Kill(const std::string& name) = 0;
  // kInvalidArgument for a job that was not submitted.
  virtual JobRecord Pin(const std::string& name, bool pinned) = 0;
  virtual QueuePlace PlaceInQueue(const JobRecord& job) = 0;

  // Events.
  virtual int64_t NewestRevision() = 0;
  // Of all jobs; oldest first.
  virtual std::vector<EventRecord> EventsSince(int64_t revision, int limit) = 0;
  // Of these jobs; oldest first. ServiceError REVISION_COMPACTED when events after `revision` have
  // been deleted, or when the store never was at `revision`.
  virtual std::vector<EventRecord> EventsSince(int64_t revision,
                                               const std::vector<int64_t>& job_ids,
                                               int limit) = 0;
  virtual bool AllFinished(const std::vector<int64_t>& job_ids) = 0;
  virtual JobsSnapshot Snapshot(const std::vector<int64_t>& job_ids) = 0;
  // In the order of the ids, with artifacts, as far as the budget goes.
  virtual LoadedJobs LoadJobs(const std::vector<int64_t>& job_ids, const ListBudget& budget) = 0;
  // The named jobs and their children.
  virtual std::vector<int64_t> ResolveWatch(const std::vector<std::string>& names) = 0;

  // Projects.
  // By name. A project is there once it has had a job or a blob.
  virtual std::vector<ProjectRecord> ListProjects() = 0;
  virtual ProjectRecord GetProject(const std::string& name) = 0;
  // The project may read the blob from now on; it counts for its quota.
  virtual void HoldBlob(const std::string& project, const FileDigest& blob) = 0;
  // The blobs of these that the project may read.
  virtual std::set<std::string> HeldBlobs(const std::string& project,
                                          const std::vector<std::string>& sha256) = 0;

  // Holds stay over restarts.
  virtual void SetHold(Hold hold, bool on) = 0;
  virtual std::set<Hold> Holds() = 0;
  virtual JobCounts CountJobs() = 0;
  // `scene`: stored, or empty; of a project, or of all.
  virtual std::vector<ColorizerRecord> ListColorizers(const std::optional<std::string>& project,
                                                      const std::string& scene,
                                                      int64_t before_id,
                                                      int limit) = 0;
  virtual ColorizerRecord GetColorizer(const std::optional<std::string>& project,
                                       const std::string& sha256) = 0;
};

}  // namespace color3d
