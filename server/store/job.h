// Records of the job store. Plain values.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/catalogue/captures.h"
#include "core/catalogue/error_reasons.h"

namespace color3d {

// Milliseconds since the Unix epoch. Injected, so that tests control time.
using Clock = std::function<int64_t()>;
Clock SystemClock();

// Clocks in milliseconds. `wall` (since the epoch) gives displayed times and retention; it may
// jump. `steady` (since the start of the machine) gives leases and pauses, so that a jump ends none
// of them. Both are the same for all processes of a machine.
struct Clocks {
  Clock wall;
  Clock steady;
};
Clocks SystemClocks();
// Identifies the present start of the machine: steady times of another start are meaningless.
std::string BootId();

enum class JobState { kBlocked, kQueued, kRunning, kSucceeded, kFailed, kCancelled, kSkipped };

// "BLOCKED", "QUEUED", ... as stored and as shown to people.
const char* JobStateName(JobState state);
// Throws Error{kDataLoss} for an unknown name.
JobState JobStateFromName(std::string_view name);
inline bool IsFinished(JobState state) {
  return state == JobState::kSucceeded || state == JobState::kFailed ||
         state == JobState::kCancelled || state == JobState::kSkipped;
}

struct ArtifactRecord {
  std::string name;  // path-like, unique in its job
  FileDigest digest;
  std::string media_type;
};

struct ProgressRecord {
  int64_t step = 0;
  int64_t total_steps = 0;  // 0: unknown
  std::string message;
  std::string error_name;  // empty: none yet
  double error_value = 0.0;
  double eta_seconds = -1.0;  // < 0: unknown
};

// Time, memory and warnings of a job over all attempts.
struct JobUsage {
  double seconds = 0.0;  // computing time
  int64_t peak_memory_bytes = 0;
  std::vector<std::string> warnings;
};

struct JobError {
  ErrorCode code = ErrorCode::kInternal;
  std::string reason;  // ErrorReasonName(), or the name of the code
  std::string message;
};
JobError MakeJobError(ErrorReason reason, std::string message);

constexpr int64_t kNoDeadline = INT64_MAX;

// What a worker must have to run a job.
struct JobNeeds {
  int64_t memory_bytes = 0;         // expected peak memory; 0: unknown
  std::vector<std::string> models;  // ModelNeed and BackendNeed of weights and model servers
  std::string batch_group;          // jobs of a kind with equal groups may share a batch
};

inline std::string ModelNeed(const std::string& name) { return "model " + name; }
inline std::string BackendNeed(const std::string& name) { return "backend " + name; }

struct JobRecord {
  int64_t id = 0;      // ascending in order of creation
  std::string name;    // "jobs/..."
  std::string parent;  // submitted job that this one belongs to; empty: submitted itself
  std::string kind;
  std::string scene;  // "scenes/...", as StoredScene makes it
  std::string spec;   // serialized options, opaque to the store
  std::string project;
  JobState state = JobState::kBlocked;
  bool cancel_requested = false;
  int priority = 100;
  int64_t deadline_ms = kNoDeadline;
  JobNeeds needs;
  std::string preferred_worker;  // as it is stored; empty: any
  int attempt = 0;
  int max_attempts = 3;
  int64_t lease_epoch = 0;
  ProgressRecord progress;
  JobUsage usage;
  std::vector<ArtifactRecord> artifacts;  // of succeeded jobs
  std::optional<JobError> error;
  std::string skip_reason;
  bool skipped_by_plan = false;  // by the plan at creation, not for a failed input
  bool cached = false;
  bool pinned = false;
  std::string notify_url;  // notified when the job ends; empty: none
  std::string trace;       // W3C traceparent of the call, in old jobs its trace id; or empty
  std::optional<FileDigest> checkpoint;
  int64_t queued_ms = 0;        // time spent waiting for a worker before the present wait
  int64_t queued_since_ms = 0;  // begin of the present wait; 0: not waiting
  int64_t create_ms = 0;
  int64_t start_ms = 0;  // 0: not yet
  int64_t end_ms = 0;
  std::string worker;
  int64_t revision = 0;
  int64_t row_bytes = 0;  // about what its rows take in the database
};

// Approximate memory of the record, bytes.
int64_t MemoryBytes(const JobRecord& job);

// Proof that a worker owns a running job: each write of a worker names the epoch of its claim, and
// is refused after another claim.
struct Lease {
  int64_t job_id = 0;
  int64_t epoch = 0;
};

enum class SceneState { kUploading, kActive };

struct SceneFileRecord {
  std::string path;
  FileDigest digest;
};

struct SceneRecord {
  int64_t id = 0;
  std::string name;  // "scenes/...", as StoredScene makes it
  std::string project;
  std::string display_name;
  SceneState state = SceneState::kUploading;
  CaptureLayout layout = CaptureLayout::kUnknown;
  int photo_count = 0;
  std::vector<SceneFileRecord> files;  // empty in lists
  int64_t create_ms = 0;
  int64_t commit_ms = 0;
  std::string key_color_job;  // accepted; empty: none
  int64_t row_bytes = 0;      // about what its rows take in the database
};

// Approximate size in the database of a record and its dependent rows, bytes.
int64_t RowBytes(const SceneRecord& scene);
int64_t RowBytes(const JobRecord& job, size_t inputs, size_t blobs);
constexpr int64_t kArtifactRowBytes = 300;

struct WorkerRecord {
  std::string worker_id;
  int64_t pid = 0;  // 0: on another machine
  std::string job;  // empty: idle
  int64_t memory_bytes = 0;
  int64_t heartbeat_ms = 0;
  std::string machine;
  std::string release;
  int threads = 0;
  int64_t memory_limit_bytes = 0;  // that its jobs may take; 0: unknown
  std::string simd;                // of core/simd/instruction_set.h
  int64_t cache_bytes = 0;
  int64_t cache_limit_bytes = 0;  // 0: it has no cache
  int64_t cache_hit_bytes = 0;    // since its start
  int64_t cache_miss_bytes = 0;
  int64_t finished_jobs = 0;
};

// Scenes of different projects may have the same name: a scene of a project is stored as
// "scenes/ID@PROJECT", a scene without a project under its own name.
std::string StoredScene(const std::string& name, const std::string& project);
// Returns the name without the project.
std::string PublicScene(const std::string& stored);

struct ProjectRecord {
  std::string name;          // empty: the default project
  int64_t stored_bytes = 0;  // size of its blobs
  int64_t unfinished_jobs = 0;
  // Approximate size of its rows in the database, and overhead of its files on disk.
  int64_t row_bytes = 0;
  int64_t scenes = 0;
  int64_t uncommitted_scenes = 0;
  int weight = 1;  // share of the workers, 1 to 100
};

// Returns 16 random lower-case hexadecimal digits from the system's random source.
std::string NewId();

}  // namespace color3d
