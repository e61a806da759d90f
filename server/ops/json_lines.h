// A log for machines: one JSON object a line.
#pragma once

#include <spdlog/formatter.h>

#include <memory>

namespace color3d {

// {"time": "2026-01-31T12:00:00.000Z", "level": "info", "from": "worker-1", "message": "..."}, and
// a field of its own for each NAME=VALUE of a tag that the message begins with:
// "[job=jobs/ab12 attempt=1] begins" becomes "job", "attempt" and "begins".
std::unique_ptr<spdlog::formatter> MakeJsonLines();

}  // namespace color3d
