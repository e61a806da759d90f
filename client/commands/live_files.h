// Files of the commands that colour photos live.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/commands/command.h"
#include "client/lib/live_coloring.h"

namespace color3d::client {

// Returns the given files and the photos of the given folders (of images/ if there is one), by
// name. Prints notes on skipped files. Throws Error: kNotFound for a missing file,
// kInvalidArgument for a file that is not a photo or that lies in `out` and would be overwritten.
std::vector<LivePicture> CollectPictures(const Context& context,
                                         const std::vector<std::string>& arguments,
                                         const std::filesystem::path& out);

struct LiveSummary {
  std::vector<std::string> files;   // written, relative to OUT
  std::vector<std::string> errors;  // "LABEL: reason"
  std::string colorizer;
  std::string encoder_digest;
  double seconds = 0.0;
  double first_seconds = 0.0;     // until the first picture
  ExitCode code = ExitCode::kOk;  // of the first error

  nlohmann::ordered_json ToJson() const;
};

// Colours the pictures and writes out/STEM.png (with a number if stems are equal). Errors of single
// pictures are collected.
LiveSummary ColorizeToFiles(Connection& connection,
                            const LiveSource& source,
                            const std::vector<LivePicture>& pictures,
                            const LiveOptions& options,
                            const std::filesystem::path& out);

// Prints the summary; returns its exit code.
ExitCode PrintSummary(const Context& context,
                      const LiveSummary& summary,
                      const std::filesystem::path& out);

}  // namespace color3d::client
