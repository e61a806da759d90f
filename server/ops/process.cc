#include "server/ops/process.h"

#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

// A "Name:  123 kB" line of /proc/self/status, in bytes.
int64_t StatusBytes(const std::string& field) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind(field, 0) == 0) return std::stoll(line.substr(field.size())) * 1024;
  }
  return 0;
}

}  // namespace

int64_t ResidentMemoryBytes() { return StatusBytes("VmRSS:"); }
int64_t PeakMemoryBytes() { return StatusBytes("VmHWM:"); }

void ResetPeakMemory() {
  std::ofstream clear("/proc/self/clear_refs");
  clear << "5";
}

std::filesystem::path ProgramFolder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

void SetUpLog(const std::string& name,
              const std::string& level,
              const std::filesystem::path& file) {
  const spdlog::level::level_enum parsed = spdlog::level::from_str(level);
  if (parsed == spdlog::level::off && level != "off") {
    throw InvalidArgument("log level '" + level +
                          "' is none of trace, debug, info, warn, error, off");
  }
  std::vector<spdlog::sink_ptr> sinks = {std::make_shared<spdlog::sinks::stderr_color_sink_mt>()};
  if (!file.empty()) {
    try {
      sinks.push_back(std::make_shared<spdlog::sinks::rotating_file_sink_mt>(
          file.string(), size_t{16} << 20, 3));
    } catch (const spdlog::spdlog_ex& e) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "cannot write the log " + file.string() + ": " + e.what());
    }
  }
  auto logger = std::make_shared<spdlog::logger>(name, sinks.begin(), sinks.end());
  logger->set_level(parsed);
  logger->flush_on(spdlog::level::info);
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %n %v");
  spdlog::set_default_logger(logger);
}

}  // namespace color3d
