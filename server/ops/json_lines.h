// Log format for machines: one JSON object per line.
#pragma once

#include <spdlog/formatter.h>

#include <memory>

namespace color3d {

// {"time": "2026-01-31T12:00:00.000Z", "level": "info", "from": "worker-1", "message": "..."}, and
// one field for each NAME=VALUE of a tag at the begin of the message: "[job=jobs/ab12 attempt=1]
// begins" becomes "job", "attempt" and "begins".
std::unique_ptr<spdlog::formatter> MakeJsonLines();

}  // namespace color3d
