// Job store in a database: SQLite (sqlite_job_store.h) or PostgreSQL
// (postgresql/postgresql_job_store.h). Thread-safe.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/store/job_store.h"
#include "server/store/sql_connections.h"

namespace color3d {

struct StoreOptions {
  int max_attempts = 3;
  // Delay before the first retry of a failed or lost attempt; doubles with each attempt.
  int64_t retry_backoff_ms = 2'000;
  // Time for which a job is left to the worker that holds its files.
  int64_t preference_ms = 3'000;
  std::string program_version;  // recorded in the store
  // When a server opens a SQLite store, leases of other starts of the machine end.
  std::string boot_id = BootId();
  // Distinguishes the workers of several servers on one store; empty: there is one server.
  std::string server_name = {};
};

class SqlJobStore : public JobStore {
 public:
  ~SqlJobStore() override;

  SceneRecord CreateScene(const SceneRecord& record,
                          const RequestKey& request,
                          const SceneLimits& limits) override;
  SceneRecord GetScene(const std::string& name) override;
  std::vector<SceneRecord> ListScenes(const std::optional<std::string>& project,
                                      int64_t before_id,
                                      int limit) override;
  SceneRecord ActivateScene(const std::string& name,
                            CaptureLayout layout,
                            int photo_count,
                            const RequestKey& request) override;
  SceneRecord AcceptKeyColor(const std::string& name,
                             const std::string& job,
                             const RequestKey& request) override;
  void DeleteScene(const std::string& name, const RequestKey& request) override;

  JobRecord CreateGraph(const NewGraph& graph,
                        const RequestKey& request,
                        const QueueLimits& limits) override;
  std::optional<std::string> FindRequest(const RequestKey& request) override;
  JobRecord GetJob(const std::string& name) override;
  std::vector<JobRecord> ListJobs(const JobFilter& filter,
                                  int64_t before_id,
                                  int limit,
                                  const ListBudget& budget) override;
  std::vector<JobRecord> ListChildren(const std::string& name) override;
  JobRecord Cancel(const std::string& name, const RequestKey& request) override;
  JobRecord Retry(const std::string& name,
                  bool from_scratch,
                  const RequestKey& request,
                  const QueueLimits& limits) override;
  void Delete(const std::string& name, const RequestKey& request) override;
  JobRecord Kill(const std::string& name) override;
  JobRecord Pin(const std::string& name, bool pinned) override;
  QueuePlace PlaceInQueue(const JobRecord& job) override;
  std::string WaitsFor(const JobRecord& job) override;

  using WorkerStore::Claim;
  std::optional<JobRecord> Claim(const ClaimTerms& terms) override;
  std::vector<JobRecord> GetInputs(int64_t job_id) override;
  HeartbeatReply Heartbeat(const Lease& lease,
                           const ProgressRecord& progress,
                           const JobUsage& usage,
                           int64_t lease_ms) override;
  HeartbeatReply Peek(const Lease& lease) override;
  std::optional<FileDigest> SetCheckpoint(const Lease& lease, const FileDigest& blob) override;
  bool JoinEqual(const Lease& lease, const std::string& stage_key) override;
  void Publish(const Lease& lease, const Publication& publication) override;
  void Fail(const Lease& lease, const JobError& error, const JobUsage& usage) override;
  void Release(const Lease& lease, const JobUsage& usage) override;
  std::optional<JobRecord> FindStage(const std::string& stage_key) override;

  int ReapExpired() override;
  std::vector<std::string> ExpireLeases(const std::string& worker) override;
  bool IsFull() override;
  void UpdateWorker(const WorkerRecord& worker) override;
  void RemoveWorker(const std::string& worker_id) override;
  std::vector<WorkerRecord> ListWorkers() override;
  std::vector<JobRecord> ListQueue(int max_waiting) override;
  ProjectRecord SetProjectWeight(const std::string& name, int weight) override;

  int64_t NewestRevision() override;
  std::vector<EventRecord> EventsSince(int64_t revision, int limit) override;
  std::vector<EventRecord> EventsSince(int64_t revision,
                                       const std::vector<int64_t>& job_ids,
                                       int limit) override;
  bool AllFinished(const std::vector<int64_t>& job_ids) override;
  JobsSnapshot Snapshot(const std::vector<int64_t>& job_ids) override;
  LoadedJobs LoadJobs(const std::vector<int64_t>& job_ids, const ListBudget& budget) override;
  std::vector<int64_t> ResolveWatch(const std::vector<std::string>& names) override;

  std::vector<ProjectRecord> ListProjects() override;
  ProjectRecord GetProject(const std::string& name) override;
  void HoldBlob(const std::string& project, const FileDigest& blob) override;
  std::set<std::string> HeldBlobs(const std::string& project,
                                  const std::vector<std::string>& sha256) override;
  void ForgetBlob(const std::string& sha256) override;

  std::vector<Notification> DueNotifications(int of_each_receiver) override;
  void EndNotification(int64_t job_id, int64_t first_ms) override;
  void DelayNotification(int64_t job_id, int64_t first_ms, int64_t pause_ms) override;

  void SetHold(Hold hold, bool on) override;
  std::set<Hold> Holds() override;
  JobCounts CountJobs() override;
  std::vector<ColorizerRecord> ListColorizers(const std::optional<std::string>& project,
                                              const std::string& scene,
                                              int64_t before_id,
                                              int limit) override;
  ColorizerRecord GetColorizer(const std::optional<std::string>& project,
                               const std::string& sha256) override;
  std::vector<std::string> AgeExpired(int64_t ended_before_ms, int64_t grace_ms) override;
  std::vector<std::string> AgeUnusedScenes(int64_t before_ms,
                                           int64_t uncommitted_before_ms,
                                           int64_t grace_ms) override;
  void Compact(int64_t events_before_ms, int64_t requests_before_ms) override;
  std::set<std::string> ReferencedBlobs() override;
  std::set<std::string> AwaitedBlobs() override;
  bool IsReferenced(const std::string& sha256) override;
  std::vector<BlobCandidate> AgeCandidates(const std::vector<BlobCandidate>& unnamed,
                                           int64_t grace_ms) override;
  std::vector<BlobCandidate> AgedCandidates(int64_t grace_ms) override;
  int64_t RunningEpoch(const std::string& job_name) override;

 protected:
  // No clocks: those of the database.
  SqlJobStore(std::shared_ptr<SqlConnections> connections,
              std::optional<Clocks> clocks,
              StoreOptions options);
  int64_t Now(const SqlDatabase& db) const { return clocks_ ? clocks_->wall() : db.Time(); }
  // Returns the id of a worker as it is stored. If there are several servers: "ID@SERVER", of this
  // server unless the id names one.
  std::string Qualified(const std::string& worker) const;

 private:
  // Reading (sql_job_store.cc).
  std::optional<JobRecord> FindJob(SqlDatabase& db, const std::string& name);
  JobRecord RequireJob(SqlDatabase& db, const std::string& name);
  JobRecord JobById(SqlDatabase& db, int64_t job_id);
  std::vector<ArtifactRecord> LoadArtifacts(SqlDatabase& db, int64_t job_id);
  // Reads the rows of a SelectJob statement, with artifacts, within the budget.
  std::vector<JobRecord> ReadJobs(SqlDatabase& db,
                                  SqlStatement& select,
                                  const ListBudget& budget = {});
  // Returns the children, without spec and artifacts, then the job itself.
  std::vector<JobRecord> GraphOf(SqlDatabase& db, const JobRecord& root);
  SceneRecord RequireScene(SqlDatabase& db, const std::string& name, bool with_files);

  // Returns the resource of an earlier equal request. Throws REQUEST_ID_REUSED.
  std::optional<std::string> CheckRequest(SqlDatabase& db, const RequestKey& request);
  void RecordRequest(SqlDatabase& db, const RequestKey& request, const std::string& resource);

  // Deletes, of the next events after this revision, those of finished jobs that are older than
  // this time. Returns the last revision examined; nothing if all events are younger.
  std::optional<int64_t> CompactEvents(int64_t after, int64_t before_ms);

  // Returns the time before which request ids may be deleted, as recorded a day ago by the steady
  // clock, so that a clock jump expires none; 0 if the day is not over. Records `before_ms` for the
  // next day.
  int64_t RecordedRequestAge(int64_t before_ms);

  // State machine (sql_job_state.cc).
  void AddEvent(SqlDatabase& db, int64_t job_id, bool progress);
  void SetState(SqlDatabase& db, int64_t job_id, JobState state);
  // Returns the ids of the first waiting jobs that suit the terms, the next one first.
  std::vector<int64_t> FindSuitable(const ClaimTerms& terms);
  // Leaves the job for some seconds to the worker that ran the job `earlier`, if that worker has a
  // cache of blobs and runs nothing else.
  void PreferWorker(SqlDatabase& db, int64_t job_id, int64_t earlier);
  JobRecord BeginAttempt(SqlDatabase& db,
                         int64_t job_id,
                         const std::string& worker,
                         int64_t lease_ms);
  void FinishAttempt(SqlDatabase& db, const Lease& lease, const char* outcome);
  JobRecord RequireLease(SqlDatabase& db, const Lease& lease);
  bool InputsAreReady(SqlDatabase& db, int64_t job_id);
  void QueueReadyDependants(SqlDatabase& db, int64_t job_id);
  void EndFailed(SqlDatabase& db, int64_t job_id, const JobError& error);
  void EndCancelled(SqlDatabase& db, int64_t job_id);
  void PropagateEnd(SqlDatabase& db, const JobRecord& cause);
  void EndLost(SqlDatabase& db, const JobRecord& job);
  void Requeue(SqlDatabase& db, const JobRecord& job, bool count_as_lost);
  void InsertJob(SqlDatabase& db,
                 const NewGraph& graph,
                 size_t index,
                 const std::vector<std::string>& names,
                 std::vector<int64_t>* ids);
  // Throws QUEUE_FULL or QUOTA_EXCEEDED.
  void RequireRoom(SqlDatabase& db,
                   const std::string& project,
                   int64_t jobs,
                   const QueueLimits& limits);
  // Throws QUOTA_EXCEEDED.
  void RequireRoomForScene(SqlDatabase& db, const std::string& project, const SceneLimits& limits);
  void ResetForRetry(SqlDatabase& db, const JobRecord& job, bool from_scratch);
  void StoreUsage(SqlDatabase& db, int64_t job_id, const JobUsage& usage);
  // Returns the steady time since the last call with this name; 0 at the first call after a start
  // of the machine.
  int64_t ElapsedSinceLast(SqlDatabase& db, const char* name);
  // Releases those of these blobs that no job or scene of the project names.
  void ReleaseHoldings(SqlDatabase& db,
                       const std::string& project,
                       const std::vector<std::string>& sha256);
  int64_t SteadyNow(const SqlDatabase& db) const { return clocks_ ? clocks_->steady() : db.Time(); }
  // Returns a stored record with the id that the worker gave itself. That of another server keeps
  // its stored id and has no pid, which would be of another machine.
  WorkerRecord AsTold(WorkerRecord worker) const;

  const std::shared_ptr<SqlConnections> connections_;
  const std::optional<Clocks> clocks_;
  const StoreOptions options_;
};

}  // namespace color3d
