// Logs of single jobs: lines that begin with "[job=jobs/ID ...]" also go to FOLDER/ID.log, up to
// about 1 MiB.
#pragma once

#include <spdlog/common.h>

#include <filesystem>
#include <string>

namespace color3d {

// Returns the log file of the job "jobs/ID".
std::filesystem::path JobLogFile(const std::filesystem::path& folder, const std::string& job);

// A sink for spdlog. Lines that cannot be written are dropped: a full disk must not end a job.
spdlog::sink_ptr MakeJobLogSink(const std::filesystem::path& folder);

}  // namespace color3d
