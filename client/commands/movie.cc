// `color3d turntable` and `color3d render`: render a coloured scene as a movie or as pictures.
#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/commands/colored_scene.h"
#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/commands/scene_products.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/scene_upload.h"
#include "client/lib/text.h"
#include "client/options/credit_flags.h"
#include "core/base/digest.h"
#include "core/base/file_kind.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr char kOrbit[] = "orbit", kOriginal[] = "original", kStill[] = "still";
constexpr double kSeconds = 8.0, kFramesPerSecond = 30.0;  // by default

struct MovieOptions {
  std::string target;  // folder of results, jobs/ID or scenes/ID
  std::string out;     // a file that ends in .mp4, or a folder; empty: the default of the command
  std::string path;    // kOrbit, kOriginal, kStill or a file of cameras; empty: pictures of views
  std::vector<std::string> views;
  std::optional<double> seconds;
  std::optional<double> time_s;  // dynamic scenes: the time that is shown throughout
  double frames_per_second = kFramesPerSecond;
  std::optional<int> max_side_px;
  bool pictures = false;
  bool video = true;
  bool bounce = false;
  bool skip_cache = false;
  std::string movie_name = artifact::kMovie;  // in a folder
  CreditFlags credit;                         // of pictures
};

bool IsMovieName(const fs::path& out) {
  const std::string extension = out.extension().string();
  return extension == ".mp4" || extension == ".MP4";
}

// Checks that need no server.
void Check(const MovieOptions& options) {
  options.credit.credit.Validate();
  if (options.path.empty() &&
      (options.seconds || options.time_s || options.bounce || options.pictures)) {
    throw InvalidArgument(
        "--seconds, --at, --bounce and --png need a path: --path orbit, --path original, --path "
        "still or --path FILE");
  }
  if (options.path.empty() && IsMovieName(options.out)) {
    throw InvalidArgument(
        "{} is a movie and needs a path: --path orbit, --path original, --path still or --path "
        "FILE",
        options.out);
  }
  if (!options.path.empty() && options.path != kOriginal && !options.views.empty()) {
    throw InvalidArgument("--views needs --path original; other paths pass no photos");
  }
  if (!options.video && !options.pictures) {
    throw InvalidArgument("--no-video without --png leaves nothing to write");
  }
  if (options.pictures && IsMovieName(options.out)) {
    throw InvalidArgument("--png needs a folder for the pictures; name one with -o in place of {}",
                          options.out);
  }
  if (options.out.empty() || IsMovieName(options.out)) return;
  std::error_code none;
  if (fs::exists(options.out, none) && !IsFolder(options.out)) {
    throw InvalidArgument("{} is not a folder; the name of a movie ends in .mp4", options.out);
  }
}

v1::Digest UploadCameras(Connection& connection, const std::string& path) {
  if (!IsFile(path)) {
    throw Error(
        ErrorCode::kNotFound,
        "there is no file {}; --path takes {}, {}, {} or a file of cameras (transforms.json)",
        path,
        kOrbit,
        kOriginal,
        kStill);
  }
  const UploadFile upload{path, DigestFile(path)};
  if (upload.digest.size_bytes == 0) throw InvalidArgument("{} is empty", path);
  UploadMissing(connection, {upload}, [](int64_t, int64_t) {});
  return ToProto(upload.digest);
}

int FrameCount(const MovieOptions& options) {
  const double frames = options.seconds.value_or(kSeconds) * options.frames_per_second;
  if (!std::isfinite(frames) || frames > 1e9) {
    throw InvalidArgument("--seconds {} at --fps {} are more frames than can be counted",
                          options.seconds.value_or(kSeconds),
                          options.frames_per_second);
  }
  return static_cast<int>(std::lround(frames));
}

v1::JobSpec MakeSpec(Connection& connection, const MovieOptions& options, const v1::Job& of) {
  v1::JobSpec spec = SpecOn(connection, of);
  spec.set_skip_cache(options.skip_cache);
  v1::RenderSpec* render = spec.mutable_render();
  for (const std::string& view : options.views) render->add_views(view);
  if (options.max_side_px) {
    render->set_max_side_px(*options.max_side_px);
  } else {
    SetSideOf(of, render);
  }
  if (options.path.empty()) return spec;
  if (options.path == kOrbit) {
    render->set_path(v1::RenderSpec::PATH_ORBIT);
  } else if (options.path == kOriginal) {
    render->set_path(v1::RenderSpec::PATH_PHOTOS);
  } else if (options.path == kStill) {
    render->set_path(v1::RenderSpec::PATH_STILL);
  } else {
    render->set_path(v1::RenderSpec::PATH_CAMERAS);
    *render->mutable_cameras() = UploadCameras(connection, options.path);
  }
  // A path of the capture itself keeps its own speed unless another is given.
  const bool keeps_speed =
      !options.seconds &&
      (render->has_cameras() || options.path == kStill ||
       (options.path == kOriginal && options.frames_per_second == kFramesPerSecond));
  if (!keeps_speed) render->set_frames(FrameCount(options));
  render->set_frames_per_second(options.frames_per_second);
  render->set_video(options.video);
  render->set_pictures(options.pictures);
  render->set_bounce(options.bounce);
  if (options.time_s) render->set_time_s(*options.time_s);
  return spec;
}

// Downloads the movie under its name and the other results into the folder. Returns their paths.
std::vector<std::string> Fetch(Connection& connection,
                               const v1::Job& job,
                               const MovieOptions& options,
                               ProgressDisplay& display) {
  const fs::path out = options.out;
  const fs::path folder = IsMovieName(out) ? out.parent_path() : out;
  std::vector<v1::Artifact> artifacts(job.artifacts().begin(), job.artifacts().end());
  for (v1::Artifact& artifact : artifacts) {
    if (artifact.name() != artifact::kMovie) continue;
    artifact.set_name(IsMovieName(out) ? out.filename().string() : options.movie_name);
  }
  const auto names = DownloadArtifacts(connection, artifacts, folder, display);
  CreditPictures(folder, names, options.credit);
  std::vector<std::string> files;
  for (const std::string& name : names) files.push_back((folder / name).string());
  return files;
}

ExitCode RunMovie(const Context& context, const MovieOptions& options) {
  Check(options);
  const fs::path out = options.out;
  const fs::path folder = IsMovieName(out) ? out.parent_path() : out;
  Connection connection(context.server, *context.interrupt);
  const v1::Job of = FindColoredScene(connection, options.target);
  PrepareOut(folder.empty() ? fs::path(".") : folder);
  const v1::Job submitted = SubmitJob(connection, MakeSpec(connection, options, of));
  ProgressDisplay display(context.json);
  const v1::Job job = FollowToSuccess(
      connection, context, {submitted.name()}, folder.empty() ? "." : folder.string(), display);
  const auto files = Fetch(connection, job, options, display);
  if (context.json) {
    PrintJson({{"job", job.name()},
               {"scene", job.spec().scene()},
               {"state", StateName(job.state())},
               {"out", out.string()},
               {"files", files}});
    return ExitCode::kOk;
  }
  constexpr size_t kMostLines = 12;
  std::string text;
  for (size_t i = 0; i < std::min(files.size(), kMostLines); ++i) {
    text += fmt::format(
        "{}  {}\n", files[i], HumanBytes(static_cast<int64_t>(fs::file_size(files[i]))));
  }
  if (files.size() > kMostLines) text += fmt::format("and {} more\n", files.size() - kMostLines);
  PrintText(text);
  return ExitCode::kOk;
}

void AddCommonOptions(CLI::App* command, MovieOptions* options) {
  command
      ->add_option("RESULTS",
                   options->target,
                   "Folder of results that `color3d colorize` wrote, or jobs/ID or scenes/ID")
      ->required();
  command->add_option("--seconds", options->seconds, "Length of the movie, s")
      ->check(CLI::Range(0.01, 86400.0));
  command->add_option("--fps", options->frames_per_second, "Frames per second")
      ->check(CLI::Range(1.0, 120.0))
      ->capture_default_str();
  command->add_option("--max-side", options->max_side_px, "Longer side of the pictures, px");
  command->add_option("--at", options->time_s, "Dynamic scenes only: time to show throughout, s")
      ->check(CLI::Range(0.0, 86400.0));
  command->add_flag("--bounce", options->bounce, "Go back along the path at its end");
  command->add_flag(
      "--skip-cache", options->skip_cache, "Render again even if the result is cached");
}

}  // namespace

void AddMovieCommands(CLI::App& app, Context& context) {
  const auto turning = std::make_shared<MovieOptions>();
  CLI::App* turntable =
      AddCommand(app, context, "turntable", "Render a turntable movie", [&context, turning] {
        if (turning->out.empty()) {
          turning->out = IsOnServer(turning->target) ? "." : turning->target;
        }
        return RunMovie(context, *turning);
      });
  AddCommonOptions(turntable, turning.get());
  turning->path = kOrbit;
  turning->movie_name = "turntable.mp4";
  turntable->add_option("-o,--out",
                        turning->out,
                        "FILE.mp4 or a folder; default: turntable.mp4 in the folder of results");

  const auto rendering = std::make_shared<MovieOptions>();
  CLI::App* render = AddCommand(app,
                                context,
                                "render",
                                "Render a movie along a camera path, or pictures of views",
                                [&context, rendering] { return RunMovie(context, *rendering); });
  AddCommonOptions(render, rendering.get());
  rendering->out = "render";
  render->add_option("--path",
                     rendering->path,
                     "Camera path: orbit; original (through the cameras of the photos; in dynamic "
                     "scenes along the camera of the key view); still (dynamic scenes only: the "
                     "fixed camera of the key view); or a file of cameras (transforms.json; in "
                     "dynamic scenes with the `time` of each frame). Default: pictures of views "
                     "instead of a movie");
  render->add_option("--views",
                     rendering->views,
                     "Names of the views to render, or that the path original passes");
  render->add_option("-o,--out", rendering->out, "FILE.mp4 or a folder")->capture_default_str();
  render->add_flag("--png", rendering->pictures, "Also write every frame as a picture");
  DeclareCreditFlags(*render, &rendering->credit, /*with_caption=*/true);
  render->add_flag("!--no-video", rendering->video, "With --png: write no movie");
}

}  // namespace color3d::client
