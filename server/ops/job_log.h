// Logs of single jobs: lines that begin with "[job=jobs/ID ...]" also go to FOLDER/ID.log, up to
// about 1 MiB.
#pragma once

#include <spdlog/common.h>

#include <filesystem>
#include <functional>
#include <string>

namespace color3d {

// Returns the log file of the job "jobs/ID".
std::filesystem::path JobLogFile(const std::filesystem::path& folder, const std::string& job);

// Appends a line, without its end, to the log of the job. Does nothing if the log is full or cannot
// be written: a full disk must not end a job.
void AppendJobLog(const std::filesystem::path& folder,
                  const std::string& job,
                  const std::string& line);

// A sink for spdlog that calls `append(job, line)`; lines begin with their time and level.
spdlog::sink_ptr MakeJobLogSink(
    std::function<void(const std::string& job, const std::string& line)> append);
// The same with AppendJobLog.
spdlog::sink_ptr MakeJobLogSink(const std::filesystem::path& folder);

}  // namespace color3d
