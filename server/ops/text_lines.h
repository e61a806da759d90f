// A log for people: "2026-01-31T12:00:00.000Z info worker-1 MESSAGE", times in UTC. A message is
// one line whatever it says: what would end the line or reach the terminal is escaped
// (EscapeControls).
#pragma once

#include <spdlog/formatter.h>

#include <memory>

namespace color3d {

std::unique_ptr<spdlog::formatter> MakeTextLines();

}  // namespace color3d
