// The records of the job store: plain values, no behaviour beyond names of states.
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

// Milliseconds since the Unix epoch. Injected so that tests own time.
using Clock = std::function<int64_t()>;
Clock SystemClock();

// Two clocks, milliseconds. By `wall`, since the epoch, go the times that people read, and how long
// things are kept; it may be set. By `steady`, since the machine was started, go leases and pauses:
// a clock that jumps ends none. All processes of a machine see the same.
struct Clocks {
  Clock wall;
  Clock steady;
};
Clocks SystemClocks();
// Changes with every start of the machine: steady times of another one mean nothing.
std::string BootId();

enum class JobState { kBlocked, kQueued, kRunning, kSucceeded, kFailed, kCancelled, kSkipped };

// "BLOCKED", "QUEUED", ... as stored and as shown to people.
const char* JobStateName(JobState state);
// Throws Error{kDataLoss} for a name that is none.
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

// Time and memory of a job over all its attempts, and its warnings.
struct JobUsage {
  double seconds = 0.0;  // of computing
  int64_t peak_memory_bytes = 0;
  std::vector<std::string> warnings;
};

struct JobError {
  ErrorCode code = ErrorCode::kInternal;
  std::string reason;  // ErrorReasonName(), or the name of the code
  std::string message;
};
JobError MakeJobError(ErrorReason reason, std::string message);

struct JobRecord {
  int64_t id = 0;      // grows with creation
  std::string name;    // "jobs/..."
  std::string parent;  // name of the submitted job that this one was made for; empty: submitted
  std::string kind;
  std::string scene;  // "scenes/...", as StoredScene makes it
  std::string spec;   // opaque bytes of the job's options
  std::string project;
  JobState state = JobState::kBlocked;
  bool cancel_requested = false;
  int priority = 100;
  int attempt = 0;
  int max_attempts = 3;
  int64_t lease_epoch = 0;
  ProgressRecord progress;
  JobUsage usage;
  std::vector<ArtifactRecord> artifacts;  // of succeeded jobs
  std::optional<JobError> error;
  std::string skip_reason;
  bool skipped_by_plan = false;  // at creation; not because an input failed
  bool cached = false;
  bool pinned = false;
  std::string notify_url;  // told when it has ended; empty: nobody
  std::string trace;       // of the call that made it: 32 hexadecimal digits (W3C), or empty
  std::optional<FileDigest> checkpoint;
  int64_t queued_ms = 0;        // waited for a worker, until the present wait began
  int64_t queued_since_ms = 0;  // 0: does not wait for one
  int64_t create_ms = 0;
  int64_t start_ms = 0;  // 0: not yet
  int64_t end_ms = 0;
  std::string worker;
  int64_t revision = 0;
  int64_t row_bytes = 0;  // about what its rows take in the database
};

// About what the record takes in memory.
int64_t MemoryBytes(const JobRecord& job);

// Proof that a worker still owns a running job: every write of a worker names
// the epoch of its claim, and is refused once another claim has raised it.
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
  std::vector<SceneFileRecord> files;  // left empty in lists
  int64_t create_ms = 0;
  int64_t commit_ms = 0;
  std::string key_color_job;  // accepted; empty: none
  int64_t row_bytes = 0;      // about what its rows take in the database
};

// About what a record and the rows that belong to it take in the database, bytes.
int64_t RowBytes(const SceneRecord& scene);
int64_t RowBytes(const JobRecord& job, size_t inputs, size_t blobs);
constexpr int64_t kArtifactRowBytes = 300;

struct WorkerRecord {
  std::string worker_id;
  int64_t pid = 0;
  std::string job;  // empty: idle
  int64_t memory_bytes = 0;
  int64_t heartbeat_ms = 0;
};

// Scenes of different projects may have the same name: a scene of a project is stored under
// "scenes/ID@PROJECT", one of those without a project as it is named.
std::string StoredScene(const std::string& name, const std::string& project);
// As its owners name it.
std::string PublicScene(const std::string& stored);

struct ProjectRecord {
  std::string name;          // empty: of all without a project
  int64_t stored_bytes = 0;  // of the blobs that it holds
  int64_t unfinished_jobs = 0;
  // About what its scenes, jobs and blobs take in the database, and what files take beyond their
  // length.
  int64_t row_bytes = 0;
  int64_t scenes = 0;
  int64_t uncommitted_scenes = 0;
};

// 16 random lower-case hexadecimal digits, from the system's random source.
std::string NewId();

}  // namespace color3d
