// The real queue: a server process and worker processes whose stages wait for a fixed time.
#pragma once

#include <string>

namespace color3d {

struct QueueRunOptions {
  int jobs_per_worker = 8;
  int stage_ms = 5'000;
  std::string database = "sqlite";  // or "postgresql": a private server
  // Workers with a folder of their own that reach the server by its port, as on other machines;
  // else those that the server starts itself.
  bool elsewhere = true;
  int limit_seconds = 600;  // of one run
};

struct QueueRun {
  int workers = 0;
  int jobs = 0;
  double seconds = 0.0;  // from the first start to the last end
  double jobs_per_second = 0.0;
  double seconds_per_job = 0.0;  // of one worker from start to start, mean
  // Seconds of a core for one job.
  double server_cpu = 0.0;
  double worker_cpu = 0.0;
};

// Submits the jobs while the queue is paused, waits until all workers are there, and lets them run.
// Throws Error{kInternal} if a job does not succeed in time, Error{kFailedPrecondition} if
// PostgreSQL is asked for and not installed.
QueueRun RunQueue(int workers, const QueueRunOptions& options);

}  // namespace color3d
