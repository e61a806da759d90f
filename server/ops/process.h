// Facts about this process from /proc, and its log.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace color3d {

// The folder that holds the running program.
std::filesystem::path ProgramFolder();

// Log lines to stderr, and to `file` too unless empty. `format`: "text", or "json" (json_lines.h).
// Throws Error{kInvalidArgument} for a level that is none of trace, debug, info, warn, error, off.
void SetUpLog(const std::string& name,
              const std::string& level,
              const std::string& format,
              const std::filesystem::path& file);

// From now on what is said of single jobs goes to files of their own, too (job_log.h), progress
// included.
void LogJobsTo(const std::filesystem::path& folder);

}  // namespace color3d
