// A job's artifacts on the user's disk, and the short summary at the end.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/commands/command.h"
#include "client/lib/connection.h"
#include "client/lib/progress_display.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// The artifact of this name. Throws Error{kNotFound} that lists what there is.
const v1::Artifact& FindArtifact(const v1::Job& job, const std::string& name);

// Its bytes, fetched through a temporary file.
std::string ReadArtifact(Connection& connection, const v1::Job& job, const std::string& name);

// Creates `out` when it is missing. Throws Error{kFailedPrecondition} when that fails or when it
// cannot be written.
void PrepareOut(const std::filesystem::path& out);

// Writes them to out/NAME (DownloadBelow); returns the names in order. Files that are there already
// are kept.
std::vector<std::string> DownloadArtifacts(Connection& connection,
                                           const std::vector<v1::Artifact>& artifacts,
                                           const std::filesystem::path& out,
                                           ProgressDisplay& display);

// All of a job's artifacts. After Ctrl-C throws CommandFailure{kDetached} that says how to fetch
// the rest.
std::vector<std::string> DownloadResults(Connection& connection,
                                         const Context& context,
                                         const v1::Job& job,
                                         const std::filesystem::path& out,
                                         ProgressDisplay& display);

// A JSON artifact that was downloaded into `out`; null when there is none or it cannot be read.
nlohmann::ordered_json ReadResult(const std::filesystem::path& out, const std::string& name);

// A few lines about the metrics and what else lies in `out`, for people.
std::string Summary(const std::filesystem::path& out);

}  // namespace color3d::client
