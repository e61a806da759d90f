// Part of the job store that clients call: users through their ProjectStore, operators, and the
// metrics of the server. Errors and thread safety: common_store.h.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/store/common_store.h"

namespace color3d {

// Makes a mutating call idempotent: a call with the id and body of an earlier one returns its
// result. Empty id: not idempotent.
struct RequestKey {
  std::string method;
  std::string id;
  std::string body_sha256;
};

struct NewJob {
  std::string kind;
  std::string scene;  // stored name; empty: that of the graph
  std::string spec;
  std::vector<int> inputs;              // positions in NewGraph::jobs, all below its own
  std::vector<std::string> input_jobs;  // names of existing jobs
  std::vector<std::string> blobs;       // digests in the spec; kept as long as the job
  std::string skip_reason;              // not empty: skipped by the plan
  JobNeeds needs;
};

// The last job is the submitted one; all others become its children.
struct NewGraph {
  std::string project;
  std::string scene;  // stored
  std::string notify_url;
  std::string trace;  // W3C traceparent of the call; may be empty
  int priority = 100;
  int64_t deadline_ms = kNoDeadline;
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

// Memory limits of a list of jobs.
struct ListBudget {
  int64_t bytes = INT64_MAX;       // the list ends with the job that reaches it (MemoryBytes)
  int64_t spec_bytes = INT64_MAX;  // longer specs are replaced by empty ones
};

// Reasons for giving workers no jobs.
enum class Hold {
  kPaused,   // by the operator
  kStorage,  // the disk is nearly full
};

// Place of a waiting job in the queue.
struct QueuePlace {
  int64_t position = 0;   // 1: next; 0: not waiting for a worker
  std::string waits_for;  // empty: waits for its turn
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

// Present state of some jobs and the newest revision, read in one transaction.
struct JobsSnapshot {
  std::vector<JobRecord> jobs;  // by revision, oldest first; without spec and artifacts
  int64_t revision = 0;
};

// Requested jobs within the budget.
struct LoadedJobs {
  std::vector<JobRecord> jobs;
  // Number of ids that were looked up; those missing from `jobs` were deleted.
  size_t looked_for = 0;
};

struct ColorizerRecord {
  int64_t id = 0;  // id of the job, for paging
  std::string job;
  std::string scene;
  FileDigest digest;
  int64_t create_ms = 0;
};

struct JobCounts {
  int64_t queued = 0;  // includes blocked
  int64_t running = 0;
  int64_t blocked = 0;  // waiting for inputs
  // Time when the job that has waited longest for a worker began to wait; 0: none waits.
  int64_t oldest_queued_ms = 0;
  int64_t notifications = 0;  // not delivered yet
};

// Range of the weight of a project.
constexpr int kMaxProjectWeight = 100;

class ClientStore : public virtual CommonStore {
 public:
  // Creates a scene. Requires: `record.name` is set; id and times are ignored. Throws
  // kResourceExhausted (QUOTA_EXCEEDED) if the project would exceed `limits`.
  virtual SceneRecord CreateScene(const SceneRecord& record,
                                  const RequestKey& request,
                                  const SceneLimits& limits) = 0;
  // Returns scenes with ids below `before_id` (0: all), newest first, of a project or of all.
  virtual std::vector<SceneRecord> ListScenes(const std::optional<std::string>& project,
                                              int64_t before_id,
                                              int limit) = 0;
  virtual SceneRecord ActivateScene(const std::string& name,
                                    CaptureLayout layout,
                                    int photo_count,
                                    const RequestKey& request) = 0;
  // Accepts the succeeded colorize_key_view job `job` of this scene; empty: withdraws the
  // acceptance. Throws kNotFound, kInvalidArgument or kFailedPrecondition for other jobs.
  virtual SceneRecord AcceptKeyColor(const std::string& name,
                                     const std::string& job,
                                     const RequestKey& request) = 0;
  // Deletes a scene but not its finished jobs. Refused while a job of the scene is unfinished.
  virtual void DeleteScene(const std::string& name, const RequestKey& request) = 0;

  // Jobs.
  // Creates all jobs of the graph or none. Throws kResourceExhausted (QUEUE_FULL, QUOTA_EXCEEDED)
  // if more jobs than `limits` allow would be unfinished.
  virtual JobRecord CreateGraph(const NewGraph& graph,
                                const RequestKey& request,
                                const QueueLimits& limits) = 0;
  // Returns the job created by an earlier equal request, so that a repeated call skips planning.
  virtual std::optional<std::string> FindRequest(const RequestKey& request) = 0;
  // Returns jobs with ids below `before_id` (0: all), newest first.
  virtual std::vector<JobRecord> ListJobs(const JobFilter& filter,
                                          int64_t before_id,
                                          int limit,
                                          const ListBudget& budget) = 0;
  virtual JobRecord Cancel(const std::string& name, const RequestKey& request) = 0;
  // Retries all jobs of the graph that failed, were cancelled or were therefore skipped. Throws
  // kFailedPrecondition (INPUT_DELETED) if an input was deleted, and like CreateGraph.
  virtual JobRecord Retry(const std::string& name,
                          bool from_scratch,
                          const RequestKey& request,
                          const QueueLimits& limits) = 0;
  virtual void Delete(const std::string& name, const RequestKey& request) = 0;
  // Ends the job and its children as CANCELLED at once; later writes of their workers are refused.
  virtual JobRecord Kill(const std::string& name) = 0;
  // Throws kInvalidArgument for a child of a submitted job.
  virtual JobRecord Pin(const std::string& name, bool pinned) = 0;
  virtual QueuePlace PlaceInQueue(const JobRecord& job) = 0;
  // As PlaceInQueue, without counting the jobs before it.
  virtual std::string WaitsFor(const JobRecord& job) = 0;
  // Returns the running jobs, oldest start first, then at most `max_waiting` jobs that wait for a
  // worker, in the order of their turns. Without spec and artifacts; at most 1,000 of each.
  virtual std::vector<JobRecord> ListQueue(int max_waiting) = 0;

  // Events.
  virtual int64_t NewestRevision() = 0;
  // Returns events of all jobs, oldest first.
  virtual std::vector<EventRecord> EventsSince(int64_t revision, int limit) = 0;
  // Returns events of these jobs, oldest first. Throws REVISION_COMPACTED if events after
  // `revision` were deleted or the store never reached `revision`.
  virtual std::vector<EventRecord> EventsSince(int64_t revision,
                                               const std::vector<int64_t>& job_ids,
                                               int limit) = 0;
  virtual bool AllFinished(const std::vector<int64_t>& job_ids) = 0;
  virtual JobsSnapshot Snapshot(const std::vector<int64_t>& job_ids) = 0;
  // Returns jobs with artifacts in the order of the ids, within the budget.
  virtual LoadedJobs LoadJobs(const std::vector<int64_t>& job_ids, const ListBudget& budget) = 0;
  // Returns the ids of the named jobs and of their children.
  virtual std::vector<int64_t> ResolveWatch(const std::vector<std::string>& names) = 0;

  // Projects.
  // Sorted by name. A project exists once it has had a job or a blob.
  virtual std::vector<ProjectRecord> ListProjects() = 0;
  virtual ProjectRecord GetProject(const std::string& name) = 0;
  // Requires: 1 <= weight <= kMaxProjectWeight. Creates the project if there is none.
  virtual ProjectRecord SetProjectWeight(const std::string& name, int weight) = 0;
  // Lets the project read the blob, which counts towards its quota.
  virtual void HoldBlob(const std::string& project, const FileDigest& blob) = 0;
  // Returns those of these blobs that the project may read.
  virtual std::set<std::string> HeldBlobs(const std::string& project,
                                          const std::vector<std::string>& sha256) = 0;

  // Holds survive restarts.
  virtual void SetHold(Hold hold, bool on) = 0;
  virtual std::set<Hold> Holds() = 0;
  virtual JobCounts CountJobs() = 0;
  // `scene`: stored name; empty: all scenes. No project: all projects.
  virtual std::vector<ColorizerRecord> ListColorizers(const std::optional<std::string>& project,
                                                      const std::string& scene,
                                                      int64_t before_id,
                                                      int limit) = 0;
  virtual ColorizerRecord GetColorizer(const std::optional<std::string>& project,
                                       const std::string& sha256) = 0;
};

}  // namespace color3d
