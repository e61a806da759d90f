#include "client/commands/results.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "client/commands/follow.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/result_download.h"
#include "client/lib/text.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/metrics.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

std::string Line(const std::string& label, const std::string& value) {
  return fmt::format("{:<28}{}\n", label, value);
}

FileDigest DigestOf(const v1::Artifact& artifact) {
  return {artifact.digest().sha256(), artifact.digest().size_bytes()};
}

}  // namespace

nlohmann::ordered_json ReadResult(const fs::path& out, const std::string& name) {
  if (!IsFile(out / name)) return nullptr;
  const auto json =
      nlohmann::ordered_json::parse(ReadFile(out / name), nullptr, /*allow_exceptions=*/false);
  return json.is_object() ? json : nlohmann::ordered_json();
}

const v1::Artifact& FindArtifact(const v1::Job& job, const std::string& name) {
  std::string known;
  for (const v1::Artifact& artifact : job.artifacts()) {
    if (artifact.name() == name) return artifact;
    if (known.size() < 200) known += (known.empty() ? "" : ", ") + artifact.name();
  }
  throw Error(ErrorCode::kNotFound,
              "{} has no artifact '{}'; it has {}",
              job.name(),
              name,
              known.empty() ? "none (it is " + StateName(job.state()) + ")" : known);
}

std::string ReadArtifact(Connection& connection, const v1::Job& job, const std::string& name) {
  const ScratchFolder scratch;
  const fs::path file = scratch.path() / "artifact";
  DownloadBlob(connection, DigestOf(FindArtifact(job, name)), file, [](int64_t) {});
  return ReadFile(file);
}

void PrepareOut(const fs::path& out) {
  std::error_code error;
  fs::create_directories(out, error);
  if (error || !fs::is_directory(out)) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot create the folder {}{}; name another with -o",
                out.string(),
                error ? ": " + error.message() : ": there is a file of this name");
  }
  if (::access(out.c_str(), W_OK | X_OK) != 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot write into the folder {}; name another with -o",
                out.string());
  }
}

namespace {

// `go_on`: the remedy if the server is lost.
std::vector<std::string> Fetch(Connection& connection,
                               const std::vector<v1::Artifact>& artifacts,
                               const fs::path& out,
                               ProgressDisplay& display,
                               const std::string& go_on) {
  std::vector<ResultFile> files;
  std::vector<std::string> names;
  for (const v1::Artifact& artifact : artifacts) {
    files.push_back({artifact.name(), DigestOf(artifact)});
    names.push_back(artifact.name());
  }
  const auto progress = [&](int64_t received, int64_t total) {
    display.OnTransfer("downloading", received, total);
  };
  try {
    DownloadBelow(connection, files, out, progress, go_on);
  } catch (...) {
    display.Clear();
    throw;
  }
  display.Clear();
  return names;
}

std::string FetchCommand(const Context& context, const v1::Job& job, const fs::path& out) {
  return CommandLine(context, {"artifact", "download", job.name(), "-o", out.string()});
}

}  // namespace

std::vector<std::string> DownloadArtifacts(Connection& connection,
                                           const std::vector<v1::Artifact>& artifacts,
                                           const fs::path& out,
                                           ProgressDisplay& display) {
  return Fetch(
      connection, artifacts, out, display, "run the command again: downloaded files are kept");
}

std::vector<std::string> DownloadResults(Connection& connection,
                                         const Context& context,
                                         const v1::Job& job,
                                         const fs::path& out,
                                         ProgressDisplay& display) {
  try {
    return Fetch(connection,
                 {job.artifacts().begin(), job.artifacts().end()},
                 out,
                 display,
                 "download the rest with `" + FetchCommand(context, job, out) + "`");
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kCancelled) throw;
    throw CommandFailure(
        ExitCode::kDetached,
        fmt::format("{} is done, but its results are incomplete here; download them with `{}`",
                    job.name(),
                    FetchCommand(context, job, out)));
  }
}

std::string Summary(const fs::path& out) {
  std::string text;
  const nlohmann::ordered_json metrics = ReadResult(out, artifact::kMetrics);
  std::vector<std::string> keys;
  for (const auto& [key, value] : metrics.items()) {
    if (value.is_number()) keys.push_back(key);
  }
  for (const std::string& key : InMetricOrder(std::move(keys))) {
    const auto [metric, variant] = FindMetric(key);
    if (metric == nullptr || !metric->Is(Metric::kInSummary)) continue;
    if (variant != nullptr && !variant->in_summary) continue;
    const std::string label =
        variant == nullptr ? metric->label : std::string("  ") + variant->label;
    text += Line(label, MetricText(key, metrics.at(key).get<double>()));
  }
  if (const auto seconds = metrics.find("seconds_total");
      seconds != metrics.end() && seconds->is_number()) {
    text += Line(MetricLabel("seconds_total"), HumanSeconds(seconds->get<double>()));
  }
  std::error_code none;
  for (const Artifact& artifact : ArtifactCatalogue()) {
    if (artifact.label == nullptr || !fs::exists(out / artifact.name, none)) continue;
    // For films without poses the movie is the film.
    const bool is_film = std::string_view(artifact.name) == artifact::kMovie &&
                         !fs::exists(out / artifact::kFilm, none);
    text += Line(is_film ? "coloured film" : artifact.label, (out / artifact.name).string());
  }
  return text;
}

}  // namespace color3d::client
