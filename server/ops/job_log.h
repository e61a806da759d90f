// The log of single jobs: lines that begin with "[job=jobs/ID ...]" go to FOLDER/ID.log, too, of
// about 1 MiB at most.
#pragma once

#include <spdlog/common.h>

#include <filesystem>
#include <string>

namespace color3d {

// Of the job "jobs/ID".
std::filesystem::path JobLogFile(const std::filesystem::path& folder, const std::string& job);

// A sink for spdlog. A line that cannot be written is lost: a full disk must not end a job.
spdlog::sink_ptr MakeJobLogSink(const std::filesystem::path& folder);

}  // namespace color3d
