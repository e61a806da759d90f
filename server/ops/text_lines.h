// Log format for people: "2026-01-31T12:00:00.000Z info worker-1 MESSAGE", times in UTC. Each
// message is one line: line ends and control characters are escaped (EscapeControls).
#pragma once

#include <spdlog/formatter.h>

#include <memory>

namespace color3d {

std::unique_ptr<spdlog::formatter> MakeTextLines();

}  // namespace color3d
