#include "server/ops/process.h"

#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "server/ops/job_log.h"
#include "server/ops/json_lines.h"
#include "server/ops/text_lines.h"

namespace color3d {
std::filesystem::path ProgramFolder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

void SetUpLog(const std::string& name,
              const std::string& level,
              const std::string& format,
              const std::filesystem::path& file) {
  const spdlog::level::level_enum parsed = spdlog::level::from_str(level);
  if (parsed == spdlog::level::off && level != "off") {
    throw InvalidArgument("log level '{}' is none of trace, debug, info, warn, error, off", level);
  }
  std::vector<spdlog::sink_ptr> sinks = {std::make_shared<spdlog::sinks::stderr_color_sink_mt>()};
  if (!file.empty()) {
    try {
      sinks.push_back(std::make_shared<spdlog::sinks::rotating_file_sink_mt>(
          file.string(), size_t{16} << 20, 3));
    } catch (const spdlog::spdlog_ex& e) {
      throw Error(
          ErrorCode::kFailedPrecondition, "cannot write the log {}: {}", file.string(), e.what());
    }
  }
  auto logger = std::make_shared<spdlog::logger>(name, sinks.begin(), sinks.end());
  logger->set_level(parsed);
  logger->flush_on(spdlog::level::info);
  if (format == "json") {
    logger->set_formatter(MakeJsonLines());
  } else {
    logger->set_formatter(MakeTextLines());
  }
  spdlog::set_default_logger(logger);
}

namespace {

void AddJobSink(const spdlog::sink_ptr& jobs) {
  const std::shared_ptr<spdlog::logger> logger = spdlog::default_logger();
  for (const spdlog::sink_ptr& sink : logger->sinks()) sink->set_level(logger->level());
  logger->sinks().push_back(jobs);
  logger->set_level(std::min(logger->level(), spdlog::level::debug));
}

}  // namespace

void LogJobsTo(const std::filesystem::path& folder) { AddJobSink(MakeJobLogSink(folder)); }

void LogJobsTo(std::function<void(const std::string& job, const std::string& line)> append) {
  AddJobSink(MakeJobLogSink(std::move(append)));
}

}  // namespace color3d
