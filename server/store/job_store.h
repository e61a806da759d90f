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

// How many jobs may wait or run.
struct QueueLimits {
  QueueLimits(int64_t of_all, int64_t of_one_project = INT64_MAX)  // NOLINT: a number is one
      : all(of_all), of_project(of_one_project) {}
  int64_t all;
  int64_t of_project;
};

// How many scenes a project may have.
struct SceneLimits {
  int64_t all = INT64_MAX;
  int64_t uncommitted = INT64_MAX;
};

struct JobFilter {
  std::string parent;                  // "jobs/..."
  std::string scene;                   // stored
  std::optional<std::string> project;  // nothing: all
};

// How much a list of jobs may bring into memory.
struct ListBudget {
  int64_t bytes = INT64_MAX;       // the list ends with the job that reaches it (MemoryBytes)
  int64_t spec_bytes = INT64_MAX;  // a longer spec is left empty
};

// Why workers are given no job.
enum class Hold {
  kPaused,   // by the operator
  kStorage,  // the disk is nearly full
};

// Of a job that waits.
struct QueuePlace {
  int64_t position = 0;   // 1: the next; 0: it does not wait for a worker
  std::string waits_for;  // empty: for its turn
};

// Somebody who wants to know that a job has ended.
struct Notification {
  int64_t job_id = 0;
  std::string job;
  std::string url;
  int tries = 0;
  int64_t first_ms = 0;  // when it ended
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
  std::vector<JobRecord> jobs;  // by revision, oldest first; without spec and artifacts
  int64_t revision = 0;
};

// As many of the jobs that were asked for as fit.
struct LoadedJobs {
  std::vector<JobRecord> jobs;
  size_t looked_for = 0;  // so many of the ids; those of them that are not in `jobs` were deleted
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
  int64_t blocked = 0;  // wait for inputs
  int64_t oldest_queued_ms =
      0;                      // since when the first of those waits that wait for a worker; 0: none
  int64_t notifications = 0;  // not delivered yet
};

class JobStore {
 public:
  virtual ~JobStore() = default;

  // Scenes. `record.name` must be set; its id and times are not read. kResourceExhausted
  // (QUOTA_EXCEEDED) when the project would have more scenes than `limits` allow.
  virtual SceneRecord CreateScene(const SceneRecord& record,
                                  const RequestKey& request,
                                  const SceneLimits& limits) = 0;
  virtual SceneRecord GetScene(const std::string& name) = 0;
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

  // Jobs, from the client's side.
  // Creates all jobs of the graph or none. kResourceExhausted (QUEUE_FULL, QUOTA_EXCEEDED) when
  // more jobs than `limits` allow would wait or run.
  virtual JobRecord CreateGraph(const NewGraph& graph,
                                const RequestKey& request,
                                const QueueLimits& limits) = 0;
  // The job made by an earlier request, if it was made: lets a repeated call skip planning.
  virtual std::optional<std::string> FindRequest(const RequestKey& request) = 0;
  virtual JobRecord GetJob(const std::string& name) = 0;
  // Newest first, ids below `before_id` (0: from the newest).
  virtual std::vector<JobRecord> ListJobs(const JobFilter& filter,
                                          int64_t before_id,
                                          int limit,
                                          const ListBudget& budget) = 0;
  // In order of creation, with artifacts.
  virtual std::vector<JobRecord> ListChildren(const std::string& name) = 0;
  virtual JobRecord Cancel(const std::string& name, const RequestKey& request) = 0;
  // Retries the whole graph of the job: what failed, was cancelled, or was skipped for that.
  // kFailedPrecondition (INPUT_DELETED) when what it read is gone; full queues as CreateGraph.
  virtual JobRecord Retry(const std::string& name,
                          bool from_scratch,
                          const RequestKey& request,
                          const QueueLimits& limits) = 0;
  virtual void Delete(const std::string& name, const RequestKey& request) = 0;
  // Ends the job and its children as CANCELLED now: what its workers still write is refused.
  virtual JobRecord Kill(const std::string& name) = 0;
  // kInvalidArgument for a job that was not submitted.
  virtual JobRecord Pin(const std::string& name, bool pinned) = 0;
  virtual QueuePlace PlaceInQueue(const JobRecord& job) = 0;

  // Jobs, from the worker's side.
  // The next job of the queue, where nothing holds it back: of the smallest priority, of the
  // project that has waited longest since its last turn. Error{kFailedPrecondition, WORKER_VERSION}
  // for a worker of another release than the server's.
  virtual std::optional<JobRecord> Claim(const std::string& worker, int64_t lease_ms) = 0;
  // A job of this kind to run beside those that the worker holds already: one that no worker was
  // lost with, that no waiting job of another kind comes before, and that `accept` agrees to.
  // First those of the project with the fewest running jobs, then of the submitted job with the
  // fewest.
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
  // False: nobody else does equal work now, and others will join this job when they do. True: the
  // job was put back, to be claimed when the other has ended, without counting the attempt; or has
  // ended as CANCELLED, where cancellation was asked for.
  virtual bool JoinEqual(const Lease& lease, const std::string& stage_key) = 0;
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
  // Whether writes are refused because the disk is full.
  virtual bool IsFull() = 0;
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
  // In the order of the ids, with artifacts, as far as the budget goes.
  virtual LoadedJobs LoadJobs(const std::vector<int64_t>& job_ids, const ListBudget& budget) = 0;
  // The named jobs and their children.
  virtual std::vector<int64_t> ResolveWatch(const std::vector<std::string>& names) = 0;

  // Projects.
  // By name. A project is there once it has had a job or a blob.
  virtual std::vector<ProjectRecord> ListProjects() = 0;
  virtual ProjectRecord GetProject(const std::string& name) = 0;
  // From now on the project may read the blob; it pays for it.
  virtual void HoldBlob(const std::string& project, const FileDigest& blob) = 0;
  // Those of the blobs that it may read.
  virtual std::set<std::string> HeldBlobs(const std::string& project,
                                          const std::vector<std::string>& sha256) = 0;
  // The blob is gone: nobody holds it any more, unless a job or scene names it by now.
  virtual void ForgetBlob(const std::string& sha256) = 0;

  // Notifications. A pause is an hour at most.
  // The ones that have been due for longest, of each receiver (scheme, host and port of the
  // address) at most so many, so that none keeps the others out.
  virtual std::vector<Notification> DueNotifications(int of_each_receiver) = 0;
  // Delivered or given up. Nothing happens where the job has ended anew since `first_ms`: that is
  // another word.
  virtual void EndNotification(int64_t job_id, int64_t first_ms) = 0;
  virtual void DelayNotification(int64_t job_id, int64_t first_ms, int64_t pause_ms) = 0;

  // Others.
  // Kept over restarts.
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
  // First of the two phases in which old jobs go: takes note of submitted jobs that ended before
  // this time, are not pinned and are read by no unfinished job, and forgets those that are no
  // longer so. Returns the ones noted for `grace_ms` by the steady clock.
  virtual std::vector<std::string> AgeExpired(int64_t ended_before_ms, int64_t grace_ms) = 0;
  // The same for scenes that were made and committed before `before_ms` and have no job, and for
  // those that were made before `uncommitted_before_ms` and were never committed.
  virtual std::vector<std::string> AgeUnusedScenes(int64_t before_ms,
                                                   int64_t uncommitted_before_ms,
                                                   int64_t grace_ms) = 0;
  // Deletes events of finished jobs from before the given time, and request ids from before theirs,
  // as it was told at a call a day ago by the steady clock, too.
  virtual void Compact(int64_t events_before_ms, int64_t requests_before_ms) = 0;
  // Digests of artifacts, scene files, checkpoints and of blobs that specs name.
  virtual std::set<std::string> ReferencedBlobs() = 0;
  // Those of them that only scenes name which are not committed: their upload may never come.
  virtual std::set<std::string> AwaitedBlobs() = 0;
  virtual bool IsReferenced(const std::string& sha256) = 0;
  // First of the two phases of collection: takes note of blobs that nothing names, and forgets
  // those that are not told again. Returns the ones that have been untouched, and this store open,
  // for `grace_ms` by the steady clock since they were first told.
  virtual std::vector<BlobCandidate> AgeCandidates(const std::vector<BlobCandidate>& unnamed,
                                                   int64_t grace_ms) = 0;
  // Those that it would return by what it has taken note of so far; writes nothing.
  virtual std::vector<BlobCandidate> AgedCandidates(int64_t grace_ms) = 0;
  // Epoch of the job's present lease; 0 when it is not running or does not exist.
  virtual int64_t RunningEpoch(const std::string& job_name) = 0;
  // Gives the file system back what deleted rows have left free in the database beyond
  // `keep_bytes`, some MiB at a call; how many bytes are still free in it.
  virtual int64_t GiveBackSpace(int64_t keep_bytes) = 0;
};

}  // namespace color3d
