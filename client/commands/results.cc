#include "client/commands/results.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "client/commands/follow.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/result_download.h"
#include "client/lib/text.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

struct MetricLine {
  const char* name;
  const char* label;
  int decimals;
  const char* unit;
};
constexpr MetricLine kMetricLines[] = {
    {"psnr_rgb", "PSNR of held-out views", 2, " dB"},
    {"ssim_rgb", "SSIM", 4, ""},
    {"psnr_l", "PSNR of luminance", 2, " dB"},
    {"psnr_l_camera", "  of a camera held out", 2, " dB"},
    {"psnr_l_moment", "  of single moments", 2, " dB"},
    {"psnr_l_block", "  of a block of time", 2, " dB"},
    {"delta_e00_chroma", "chroma error (CIEDE2000)", 2, ""},
    {"delta_e00_chroma_camera", "  of a camera held out", 2, ""},
    {"delta_e00_chroma_moment", "  of single moments", 2, ""},
    {"delta_e00_chroma_block", "  of a block of time", 2, ""},
    {"delta_e00_chroma_bound", "  with all true colours", 2, ""},
    {"delta_e00_gray", "  for comparison, grey", 2, ""},
    {"tc_chroma", "TC of chroma (Lab)", 2, ""},
    {"tc_chroma_truth", "  of the true colours", 2, ""},
    {"cdc", "CDC", 5, ""},
    {"cdc_truth", "  of the true colours", 5, ""},
    {"share_seen", "share seen in a key view", 2, ""},
    {"gaussians", "Gaussians", 0, ""},
};

std::string Line(const std::string& label, const std::string& value) {
  return fmt::format("{:<28}{}\n", label, value);
}

FileDigest DigestOf(const v1::Artifact& artifact) {
  return {artifact.digest().sha256(), artifact.digest().size_bytes()};
}

}  // namespace

nlohmann::ordered_json ReadResult(const fs::path& out, const std::string& name) {
  std::error_code none;
  if (!fs::is_regular_file(out / name, none)) return nullptr;
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

// `go_on`: how to fetch the rest when the server is gone.
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
  return Fetch(connection,
               artifacts,
               out,
               display,
               "run the command again: what is there is not fetched again");
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
                 "fetch the rest with `" + FetchCommand(context, job, out) + "`");
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kCancelled) throw;
    throw CommandFailure(
        ExitCode::kDetached,
        fmt::format("{} is done, its results are partly here; fetch them with `{}`",
                    job.name(),
                    FetchCommand(context, job, out)));
  }
}

std::string Summary(const fs::path& out) {
  std::string text;
  const nlohmann::ordered_json metrics = ReadResult(out, artifact::kMetrics);
  const auto number = [&](const char* name) -> std::optional<double> {
    const auto found = metrics.find(name);
    if (found == metrics.end() || !found->is_number()) return std::nullopt;
    return found->get<double>();
  };
  for (const MetricLine& line : kMetricLines) {
    if (const auto value = number(line.name)) {
      text += Line(line.label, fmt::format("{:.{}f}{}", *value, line.decimals, line.unit));
    }
  }
  if (const auto seconds = number("seconds_total")) {
    text += Line("computing time", HumanSeconds(*seconds));
  }
  std::error_code none;
  // Of a film with poses the movie is a rendered one.
  const bool has_film = fs::exists(out / artifact::kFilm, none);
  const std::pair<const char*, const char*> files[] = {
      {"coloured film", artifact::kFilm},
      {"of every camera", artifact::kFilms},
      {"coloured frames", artifact::kFilmFrames},
      {has_film ? "rendered movie" : "coloured film", artifact::kMovie},
      {"coloured scene", artifact::kPly},
      {"report", artifact::kReport},
      {"in the browser", artifact::kViewPage}};
  for (const auto& [label, name] : files) {
    if (fs::exists(out / name, none)) text += Line(label, (out / name).string());
  }
  return text;
}

}  // namespace color3d::client
