// Downloads the artifacts of a job and prints their summary.
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

// Throws Error{kNotFound} with the names that there are if the job has no such artifact.
const v1::Artifact& FindArtifact(const v1::Job& job, const std::string& name);

// Returns the bytes of an artifact, downloaded through a temporary file.
std::string ReadArtifact(Connection& connection, const v1::Job& job, const std::string& name);

// Creates the folder `out` if it is missing. Throws Error{kFailedPrecondition} if it cannot be
// created or written to.
void PrepareOut(const std::filesystem::path& out);

// Downloads artifacts to out/NAME (DownloadBelow). Returns their names in order. Files that are
// already there are kept.
std::vector<std::string> DownloadArtifacts(Connection& connection,
                                           const std::vector<v1::Artifact>& artifacts,
                                           const std::filesystem::path& out,
                                           ProgressDisplay& display);

// Downloads all artifacts of a job. After Ctrl-C throws CommandFailure{kDetached} with the command
// that downloads the rest.
std::vector<std::string> DownloadResults(Connection& connection,
                                         const Context& context,
                                         const v1::Job& job,
                                         const std::filesystem::path& out,
                                         ProgressDisplay& display);

// Returns a JSON artifact in `out`; null if there is none or it cannot be read.
nlohmann::ordered_json ReadResult(const std::filesystem::path& out, const std::string& name);

// Returns a summary for the user: metrics (Metric::kInSummary) and results (Artifact::label) in
// `out`.
std::string Summary(const std::filesystem::path& out);

}  // namespace color3d::client
