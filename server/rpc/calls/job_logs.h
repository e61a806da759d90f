// Logs of jobs, which ReadJobLog sends: in files of the data folder, or in a database that several
// servers share. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "server/store/shared_job_logs.h"

namespace color3d {

class JobLogs {
 public:
  virtual ~JobLogs() = default;
  // Appends whole lines, up to about 1 MiB in all. A full disk must not end a job: errors are only
  // logged.
  virtual void Append(const std::string& job, const std::string& lines) = 0;
  // Returns bytes from `offset`, at most about `max_bytes`; empty at the end.
  virtual std::string Read(const std::string& job, int64_t offset, size_t max_bytes) = 0;
};

// `folder`: of DataPaths::JobLogs.
std::unique_ptr<JobLogs> MakeFileJobLogs(const std::filesystem::path& folder);
// Logs that the store does not have are read from `earlier`, where they were before a move to
// PostgreSQL. The store must outlive the result.
std::unique_ptr<JobLogs> MakeSharedJobLogs(SharedJobLogs& store,
                                           const std::filesystem::path& earlier);

}  // namespace color3d
