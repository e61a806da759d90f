// Times of the calls of workers on a job store with a long history and a long queue.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/scale/queue_model.h"

namespace color3d {

struct StoreLoad {
  std::string database = "sqlite";  // or "postgresql": a private server that syncs to disk
  int64_t finished = 1'000'000;
  int64_t queued = 10'000;
  int claims = 1'000;  // by one caller, then again by all callers
  int callers = 8;
  int projects = 4;
};

// Milliseconds.
struct CallTimes {
  std::string call;
  int64_t calls = 0;
  double p50 = 0.0;
  double p99 = 0.0;
  double most = 0.0;
  // Of a core in this process: all of the work for SQLite, but for waiting for the disk.
  double cpu_p50 = 0.0;
  double cpu_p99 = 0.0;
};

struct StoreTimes {
  double filling_seconds = 0.0;
  std::vector<CallTimes> calls;
  ServiceTimes service;  // medians, which other programs on the machine change least; no CPU
};

// Throws Error{kInvalidArgument} for an unknown database or too few queued jobs,
// Error{kFailedPrecondition} if PostgreSQL is not installed.
StoreTimes MeasureStore(const StoreLoad& load);

}  // namespace color3d
