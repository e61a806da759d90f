// What the server and its workers share: scenes, jobs, leases and events. The database is the
// queue. At-least-once execution, exactly-once effects: a claim raises the job's lease epoch, and
// every write of a worker is refused with Error{kAborted, LEASE_LOST} when its epoch is not the
// present one. All methods are thread-safe and may be called from several processes on one store;
// each is one transaction. Errors: kNotFound, kFailedPrecondition (wrong state), kInvalidArgument
// (REQUEST_ID_REUSED), kUnavailable (store busy), kResourceExhausted (disk full).
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/store/job.h"

namespace color3d {

// Makes a mutating call idempotent: the same id with the same body returns what the first call
// made. An empty id switches it off.
struct RequestKey {
  std::string method;
  std::string id;
  std::string body_sha256;
};

struct NewJob {
  std::string kind;
  std::string scene;  // empty: the graph's
  std::string spec;
  std::vector<int> inputs;              // positions in NewGraph::jobs, all smaller than its own
  std::vector<std::string> input_jobs;  // names of jobs that exist
  std::vector<std::string> blobs;       // digests that the spec names; kept alive with the job
  std::string skip_reason;              // not empty: the plan leaves it out
};

// The submitted job is the last one; all others become its children.
struct NewGraph {
  std::string scene;
  int priority = 100;
  std::vector<NewJob> jobs;
};

struct JobFilter {
  std::string parent;  // "jobs/..."
  std::string scene;   // "scenes/..."
};

struct HeartbeatReply {
  bool cancel_requested = false;
};

struct Publication {
  std::vector<ArtifactRecord> artifacts;
  std::string stage_key;  // empty: not to be found by later equal jobs
  bool cached = false;
  JobUsage usage;
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

// The present state of some jobs together with the newest revision of the store, read at one time.
struct JobsSnapshot {
  std::vector<JobRecord> jobs;  // by revision, oldest first
  int64_t revision = 0;
};

struct ColorizerRecord {
  int64_t id = 0;  // of the job, for paging
  std::string job;
  std::string scene;
  FileDigest digest;
  int64_t create_ms = 0;
};

// A blob that nothing names, as it was last touched.
struct BlobCandidate {
  std::string sha256;
  int64_t touched_ns = 0;
};

struct JobCounts {
  int64_t queued = 0;  // with those that wait for inputs
  int64_t running = 0;
};

class JobStore {
 public:
  virtual ~JobStore() = default;

  // Scenes. `record.name` must be set; its id and times are not read.
  virtual SceneRecord CreateScene(const SceneRecord& record, const RequestKey& request) = 0;
  virtual SceneRecord GetScene(const std::string& name) = 0;
  // Newest first, ids below `before_id` (0: from the newest).
  virtual std::vector<SceneRecord> ListScenes(int64_t before_id, int limit) = 0;
  virtual SceneRecord ActivateScene(const std::string& name,
                                    StoredLayout layout,
                                    int photo_count,
                                    const RequestKey& request) = 0;
  // `job`: a colorize_key_view job of this scene that has succeeded, or empty to take it back.
  // kNotFound, kInvalidArgument or kFailedPrecondition otherwise.
  virtual SceneRecord AcceptKeyColor(const std::string& name,
                                     const std::string& job,
                                     const RequestKey& request) = 0;
  // Refused while a job of the scene is not finished; its finished jobs stay.
  virtual void DeleteScene(const std::string& name, const RequestKey& request) = 0;

  // Jobs, from the client's side.
  // Creates all jobs of the graph or none. kResourceExhausted (QUEUE_FULL) when more than
  // `max_unfinished` jobs would wait or run.
  virtual JobRecord CreateGraph(const NewGraph& graph,
                                const RequestKey& request,
                                int64_t max_unfinished) = 0;
  // The job made by an earlier request, if it was made: lets a repeated call skip planning.
  virtual std::optional<std::string> FindRequest(const RequestKey& request) = 0;
  virtual JobRecord GetJob(const std::string& name) = 0;
  virtual std::vector<JobRecord> ListJobs(const JobFilter& filter,
                                          int64_t before_id,
                                          int limit) = 0;
  // In order of creation, with artifacts.
  virtual std::vector<JobRecord> ListChildren(const std::string& name) = 0;
  virtual JobRecord Cancel(const std::string& name, const RequestKey& request) = 0;
  // Retries the whole graph of the job: what failed, was cancelled, or was skipped for that.
  // kFailedPrecondition (INPUT_DELETED) when what it read is gone; QUEUE_FULL as CreateGraph.
  virtual JobRecord Retry(const std::string& name,
                          bool from_scratch,
                          const RequestKey& request,
                          int64_t max_unfinished) = 0;
  virtual void Delete(const std::string& name, const RequestKey& request) = 0;

  // Jobs, from the worker's side.
  // The next job of the queue. Error{kFailedPrecondition, WORKER_VERSION} for a worker of another
  // release than the server's.
  virtual std::optional<JobRecord> Claim(const std::string& worker, int64_t lease_ms) = 0;
  // A job of this kind to run beside those that the worker holds already: one that no worker was
  // lost with, that no waiting job of another kind comes before, of the submitted job with the
  // fewest running jobs, and that `accept` agrees to.
  virtual std::optional<JobRecord> ClaimForBatch(
      const std::string& worker,
      int64_t lease_ms,
      const std::string& kind,
      const std::function<bool(const JobRecord&)>& accept) = 0;
  // The jobs that this one depends on, in order of creation, with artifacts.
  virtual std::vector<JobRecord> GetInputs(int64_t job_id) = 0;
  // Extends the lease and stores progress, seconds and warnings (cheap: not synced to disk).
  virtual HeartbeatReply Heartbeat(const Lease& lease,
                                   const ProgressRecord& progress,
                                   const JobUsage& usage,
                                   int64_t lease_ms) = 0;
  // Reads only: whether the lease holds (kAborted if not) and cancellation was asked for.
  virtual HeartbeatReply Peek(const Lease& lease) = 0;
  // Returns the checkpoint that this one replaces.
  virtual std::optional<FileDigest> SetCheckpoint(const Lease& lease, const FileDigest& blob) = 0;
  virtual void Publish(const Lease& lease, const Publication& publication) = 0;
  // kUnavailable and kAborted are tried again, with back-off, while attempts are left; kCancelled
  // ends as CANCELLED when cancellation was asked for.
  virtual void Fail(const Lease& lease, const JobError& error, const JobUsage& usage) = 0;
  // Back to the queue without counting the attempt (drain).
  virtual void Release(const Lease& lease, const JobUsage& usage) = 0;
  // Artifacts of a succeeded job with this key, newest first.
  virtual std::optional<JobRecord> FindStage(const std::string& stage_key) = 0;

  // Leases.
  // Ends the attempts whose lease ran out; returns how many.
  virtual int ReapExpired() = 0;
  // For a worker known to be dead: its leases run out now. Returns the jobs' names.
  virtual std::vector<std::string> ExpireLeasesOf(const std::string& worker) = 0;
  // Whether somebody keeps all others from writing for as long as this looks, about a second.
  virtual bool IsHeld() = 0;
  virtual void UpdateWorker(const WorkerRecord& worker) = 0;
  virtual void RemoveWorker(const std::string& worker_id) = 0;
  virtual std::vector<WorkerRecord> ListWorkers() = 0;

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
  // The named jobs and their children.
  virtual std::vector<int64_t> ResolveWatch(const std::vector<std::string>& names) = 0;

  // Others.
  virtual JobCounts CountJobs() = 0;
  virtual std::vector<ColorizerRecord> ListColorizers(const std::string& scene,
                                                      int64_t before_id,
                                                      int limit) = 0;
  virtual ColorizerRecord GetColorizer(const std::string& sha256) = 0;
  // Deletes events and request ids that ended before the given time.
  virtual void Compact(int64_t events_before_ms, int64_t requests_before_ms) = 0;
  // Digests of artifacts, scene files, checkpoints and of blobs that specs name.
  virtual std::set<std::string> ReferencedBlobs() = 0;
  virtual bool IsReferenced(const std::string& sha256) = 0;
  // First of the two phases of collection: takes note of blobs that nothing names, and forgets
  // those that are not told again. Returns the ones that have been untouched, and this store open,
  // for `grace_ms` by the steady clock since they were first told.
  virtual std::vector<BlobCandidate> AgeCandidates(const std::vector<BlobCandidate>& unnamed,
                                                   int64_t grace_ms) = 0;
  // Epoch of the job's present lease; 0 when it is not running or does not exist.
  virtual int64_t RunningEpoch(const std::string& job_name) = 0;
};

}  // namespace color3d
