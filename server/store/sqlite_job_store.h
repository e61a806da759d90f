// Job store in one SQLite file (WAL) of one server; commands for operators may read it meanwhile.
// Thread-safe. Reads do not wait; writes wait for each other, also across processes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/store/job_store.h"
#include "server/store/sqlite_connections.h"
#include "server/store/store_schema.h"

namespace color3d {

struct StoreOptions {
  int max_attempts = 3;
  // Delay before the first retry of a failed or lost attempt; doubles with each attempt.
  int64_t retry_backoff_ms = 2'000;
  std::string program_version;  // recorded in the store
  // When a server opens the store, leases of other starts of the machine end.
  std::string boot_id = BootId();
};

class SqliteJobStore : public JobStore {
 public:
  // Throws like PrepareStore.
  SqliteJobStore(const std::filesystem::path& file,
                 StoreRole role,
                 Clocks clocks,
                 StoreOptions options = {});
  ~SqliteJobStore() override;

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

  std::optional<JobRecord> Claim(const std::string& worker, int64_t lease_ms) override;
  std::optional<JobRecord> ClaimAccepted(const std::string& worker,
                                         int64_t lease_ms,
                                         const JobChoice& accept) override;
  std::optional<JobRecord> ClaimForBatch(const std::string& worker,
                                         int64_t lease_ms,
                                         const std::string& kind,
                                         const JobChoice& accept) override;
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
  int64_t ReturnFreeSpace(int64_t keep_bytes) override;

 private:
  // Reading (sqlite_job_store.cc).
  std::optional<JobRecord> FindJob(SqliteDatabase& db, const std::string& name);
  JobRecord RequireJob(SqliteDatabase& db, const std::string& name);
  JobRecord JobById(SqliteDatabase& db, int64_t job_id);
  std::vector<ArtifactRecord> LoadArtifacts(SqliteDatabase& db, int64_t job_id);
  // Reads the rows of a SelectJob statement, with artifacts, within the budget.
  std::vector<JobRecord> ReadJobs(SqliteDatabase& db,
                                  SqliteStatement& select,
                                  const ListBudget& budget = {});
  // Returns the children, without spec and artifacts, then the job itself.
  std::vector<JobRecord> GraphOf(SqliteDatabase& db, const JobRecord& root);
  SceneRecord RequireScene(SqliteDatabase& db, const std::string& name, bool with_files);

  // Returns the resource of an earlier equal request. Throws REQUEST_ID_REUSED.
  std::optional<std::string> CheckRequest(SqliteDatabase& db, const RequestKey& request);
  void RecordRequest(SqliteDatabase& db, const RequestKey& request, const std::string& resource);

  // Deletes, of the next events after this revision, those of finished jobs that are older than
  // this time. Returns the last revision examined; nothing if all events are younger.
  std::optional<int64_t> CompactEvents(int64_t after, int64_t before_ms);

  // Returns the time before which request ids may be deleted, as recorded a day ago by the steady
  // clock, so that a clock jump expires none; 0 if the day is not over. Records `before_ms` for the
  // next day.
  int64_t RecordedRequestAge(int64_t before_ms);

  // State machine (sqlite_job_state.cc).
  void AddEvent(SqliteDatabase& db, int64_t job_id, bool progress);
  void SetState(SqliteDatabase& db, int64_t job_id, JobState state);
  // Claims the job that `choose` finds, unless none was found in a look that only reads.
  std::optional<JobRecord> ClaimChosen(
      const std::string& worker,
      int64_t lease_ms,
      const std::function<std::optional<int64_t>(SqliteDatabase&)>& choose);
  JobRecord BeginAttempt(SqliteDatabase& db,
                         int64_t job_id,
                         const std::string& worker,
                         int64_t lease_ms);
  void FinishAttempt(SqliteDatabase& db, const Lease& lease, const char* outcome);
  JobRecord RequireLease(SqliteDatabase& db, const Lease& lease);
  bool InputsAreReady(SqliteDatabase& db, int64_t job_id);
  void QueueReadyDependants(SqliteDatabase& db, int64_t job_id);
  void EndFailed(SqliteDatabase& db, int64_t job_id, const JobError& error);
  void EndCancelled(SqliteDatabase& db, int64_t job_id);
  void PropagateEnd(SqliteDatabase& db, const JobRecord& cause);
  void Requeue(SqliteDatabase& db, const JobRecord& job, bool count_as_lost);
  void InsertJob(SqliteDatabase& db,
                 const NewGraph& graph,
                 size_t index,
                 const std::vector<std::string>& names,
                 std::vector<int64_t>* ids);
  // Throws QUEUE_FULL or QUOTA_EXCEEDED.
  void RequireRoom(SqliteDatabase& db,
                   const std::string& project,
                   int64_t jobs,
                   const QueueLimits& limits);
  // Throws QUOTA_EXCEEDED.
  void RequireRoomForScene(SqliteDatabase& db,
                           const std::string& project,
                           const SceneLimits& limits);
  void ResetForRetry(SqliteDatabase& db, const JobRecord& job, bool from_scratch);
  void StoreUsage(SqliteDatabase& db, int64_t job_id, const JobUsage& usage);
  // Returns the steady time since the last call with this name; 0 at the first call after a start
  // of the machine.
  int64_t ElapsedSinceLast(SqliteDatabase& db, const char* name);
  // Releases those of these blobs that no job or scene of the project names.
  void ReleaseHoldings(SqliteDatabase& db,
                       const std::string& project,
                       const std::vector<std::string>& sha256);
  int64_t Now() const { return clocks_.wall(); }
  int64_t SteadyNow() const { return clocks_.steady(); }

  const std::filesystem::path file_;
  SqliteConnections connections_;
  Clocks clocks_;
  StoreOptions options_;
};

}  // namespace color3d
