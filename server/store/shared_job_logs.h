// Job logs in a database that several servers share. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace color3d {

class SharedJobLogs {
 public:
  virtual ~SharedJobLogs() = default;
  // Appends whole lines to the log of the job, up to about 1 MiB. Does nothing for an unknown job.
  virtual void AppendJobLog(const std::string& job, const std::string& lines) = 0;
  // Returns at most about `max_bytes` from `offset`; empty at the end.
  virtual std::string ReadJobLog(const std::string& job, int64_t offset, size_t max_bytes) = 0;
};

}  // namespace color3d
