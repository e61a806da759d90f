// Photos in and coloured pictures out, for the commands that colour live.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/commands/command.h"
#include "client/lib/live_coloring.h"

namespace color3d::client {

// Files as they are given, and the photos of folders (in images/ when there is one), by name.
// Prints notes on what is passed over. Throws Error{kNotFound} or kInvalidArgument naming what is
// no photo, or when one of them lies in `out`, where the answers would replace it.
std::vector<LivePicture> CollectPictures(const Context& context,
                                         const std::vector<std::string>& arguments,
                                         const std::filesystem::path& out);

struct LiveSummary {
  std::vector<std::string> files;   // written, relative to OUT
  std::vector<std::string> errors;  // "LABEL: why"
  std::string colorizer;
  std::string encoder_digest;
  double seconds = 0.0;
  double first_seconds = 0.0;     // until the first was there
  ExitCode code = ExitCode::kOk;  // of the first error

  nlohmann::ordered_json ToJson() const;
};

// Colours them and writes out/STEM.png (a number is added where stems are equal). Errors of single
// pictures are collected.
LiveSummary ColorizeToFiles(Connection& connection,
                            const LiveSource& source,
                            const std::vector<LivePicture>& pictures,
                            const LiveOptions& options,
                            const std::filesystem::path& out);

// Prints the summary; returns its exit code.
ExitCode Conclude(const Context& context,
                  const LiveSummary& summary,
                  const std::filesystem::path& out);

}  // namespace color3d::client
