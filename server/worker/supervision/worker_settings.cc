#include "server/worker/supervision/worker_settings.h"

#include <fmt/format.h>

namespace color3d {

std::vector<std::string> ToFlags(const WorkerSettings& settings) {
  std::vector<std::string> flags = {"--data-dir",
                                    settings.data_folder.string(),
                                    "--threads",
                                    fmt::to_string(settings.threads),
                                    "--memory-mib",
                                    fmt::to_string(settings.memory_mib),
                                    "--log-level",
                                    settings.log_level,
                                    "--log-format",
                                    settings.log_format,
                                    "--reserve-mib",
                                    fmt::to_string(settings.reserve_mib),
                                    "--blob-cache-mib",
                                    fmt::to_string(settings.blob_cache_mib),
                                    "--drain-grace-seconds",
                                    fmt::to_string(settings.drain_grace_seconds)};
  VisitTimings(settings, [&](const char* flag, const auto& value) {
    flags.insert(flags.end(), {flag, fmt::to_string(value)});
  });
  if (settings.sends_logs) flags.emplace_back("--send-logs");
  if (!settings.otlp_endpoint.empty()) {
    flags.insert(flags.end(), {"--otlp-endpoint", settings.otlp_endpoint});
  }
  if (!settings.sandbox) flags.emplace_back("--no-sandbox");
  return flags;
}

}  // namespace color3d
