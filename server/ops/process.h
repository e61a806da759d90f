// Process facts from /proc, and set-up of the log.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace color3d {

// Returns the folder of the running program.
std::filesystem::path ProgramFolder();

// Logs to stderr, and also to `file` unless it is empty. `format`: "text", or "json"
// (json_lines.h). Throws Error{kInvalidArgument} unless the level is trace, debug, info, warn,
// error or off.
void SetUpLog(const std::string& name,
              const std::string& level,
              const std::string& format,
              const std::filesystem::path& file);

// From now on lines about single jobs, including progress, also go to files of their own
// (job_log.h).
void LogJobsTo(const std::filesystem::path& folder);
// The same, to `append(job, line)`, which may be called by any thread and must not log.
void LogJobsTo(std::function<void(const std::string& job, const std::string& line)> append);

}  // namespace color3d
