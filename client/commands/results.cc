#include "client/commands/results.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/commands/follow.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/text.h"
#include "core/base/files.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

struct MetricLine {
  const char* name;
  const char* format;
};
constexpr MetricLine kMetricLines[] = {
    {"psnr_rgb", "PSNR of held-out views      %.2f dB"},
    {"ssim_rgb", "SSIM                        %.4f"},
    {"psnr_l", "PSNR of luminance           %.2f dB"},
    {"delta_e00_chroma", "chroma error (CIEDE2000)    %.2f"},
    {"delta_e00_chroma_bound", "  with all true colours     %.2f"},
    {"delta_e00_gray", "  for comparison, grey      %.2f"},
    {"share_seen", "share seen in a key view    %.2f"},
    {"gaussians", "Gaussians                   %.0f"},
};

FileDigest DigestOf(const v1::Artifact& artifact) {
  return {artifact.digest().sha256(), artifact.digest().size_bytes()};
}

// Empty when there is none or it cannot be read: a summary is not worth an error.
nlohmann::json ReadMetrics(const fs::path& out) {
  std::error_code none;
  if (!fs::is_regular_file(out / "metrics.json", none)) return {};
  const auto json =
      nlohmann::json::parse(ReadFile(out / "metrics.json"), nullptr, /*allow_exceptions=*/false);
  return json.is_object() ? json : nlohmann::json();
}

}  // namespace

const v1::Artifact& FindArtifact(const v1::Job& job, const std::string& name) {
  std::string known;
  for (const v1::Artifact& artifact : job.artifacts()) {
    if (artifact.name() == name) return artifact;
    if (known.size() < 200) known += (known.empty() ? "" : ", ") + artifact.name();
  }
  throw Error(ErrorCode::kNotFound,
              job.name() + " has no artifact '" + name + "'; it has " +
                  (known.empty() ? "none (it is " + StateName(job.state()) + ")" : known));
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
                "cannot create the folder " + out.string() +
                    (error ? ": " + error.message() : ": there is a file of this name") +
                    "; name another with -o");
  }
  if (::access(out.c_str(), W_OK | X_OK) != 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot write into the folder " + out.string() + "; name another with -o");
  }
}

std::vector<std::string> DownloadArtifacts(Connection& connection,
                                           const std::vector<v1::Artifact>& artifacts,
                                           const fs::path& out,
                                           ProgressDisplay& display) {
  int64_t total = 0;
  for (const v1::Artifact& artifact : artifacts) {
    if (!IsSafeRelativePath(artifact.name())) {
      throw Error(ErrorCode::kDataLoss, "the artifact name '" + artifact.name() + "' is not safe");
    }
    total += artifact.digest().size_bytes();
  }
  int64_t before = 0;
  std::vector<std::string> names;
  for (const v1::Artifact& artifact : artifacts) {
    DownloadBlob(connection, DigestOf(artifact), out / artifact.name(), [&](int64_t received) {
      display.OnTransfer("downloading", before + received, total);
    });
    before += artifact.digest().size_bytes();
    names.push_back(artifact.name());
  }
  display.Clear();
  return names;
}

std::vector<std::string> DownloadResults(Connection& connection,
                                         const Context& context,
                                         const v1::Job& job,
                                         const fs::path& out,
                                         ProgressDisplay& display) {
  try {
    return DownloadArtifacts(
        connection, {job.artifacts().begin(), job.artifacts().end()}, out, display);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kCancelled) throw;
    throw CommandFailure(
        ExitCode::kDetached,
        job.name() + " is done, its results are partly here; fetch them with `" +
            CommandLine(context, {"artifact", "download", job.name(), "-o", out.string()}) + "`");
  }
}

std::string Summary(const fs::path& out) {
  std::string text;
  const nlohmann::json metrics = ReadMetrics(out);
  for (const MetricLine& line : kMetricLines) {
    const auto found = metrics.find(line.name);
    if (found == metrics.end() || !found->is_number()) continue;
    char buffer[120];
    std::snprintf(buffer, sizeof(buffer), line.format, found->get<double>());
    text += std::string(buffer) + "\n";
  }
  const auto seconds = metrics.find("seconds_total");
  if (seconds != metrics.end() && seconds->is_number()) {
    text += "computing time              " + HumanSeconds(seconds->get<double>()) + "\n";
  }
  std::error_code none;
  if (fs::exists(out / "scene.ply", none)) {
    text += "coloured scene              " + (out / "scene.ply").string() + "\n";
  }
  if (fs::exists(out / "report.html", none)) {
    text += "report                      " + (out / "report.html").string() + "\n";
  }
  return text;
}

}  // namespace color3d::client
