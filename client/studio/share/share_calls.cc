#include "client/studio/share/share_calls.h"

#include <algorithm>
#include <cmath>

#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/commands/scene_products.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/studio/live_png.h"
#include "core/base/error.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace {

constexpr double kMovieRate = 30.0;  // frames a second
constexpr double kLeastSeconds = 1.0, kMostSeconds = 120.0;

v1::RenderSpec::Path PathOf(const std::string& name) {
  if (name == "orbit") return v1::RenderSpec::PATH_ORBIT;
  if (name == "photos") return v1::RenderSpec::PATH_PHOTOS;
  if (name == "still") return v1::RenderSpec::PATH_STILL;
  throw InvalidArgument("the path of a movie is orbit, photos or still");
}

// The coloured run. Throws Error{kFailedPrecondition} if there is nothing to share yet.
v1::Job RunToShare(Connection& connection, const std::string& run) {
  v1::Job job = GetJob(connection, ResourceName(run, "jobs"));
  if (job.state() != v1::Job::STATE_SUCCEEDED) {
    throw Error(ErrorCode::kFailedPrecondition, "the scene is not coloured yet; wait for its end");
  }
  return job;
}

}  // namespace

v1::Job ShareCalls::MakeMovie(const std::string& run, const MovieWish& wish) const {
  const v1::RenderSpec::Path path = PathOf(wish.path);
  if (wish.seconds && !(*wish.seconds >= kLeastSeconds && *wish.seconds <= kMostSeconds)) {
    throw InvalidArgument(
        "a movie of {} s; {} to {} s are possible", *wish.seconds, kLeastSeconds, kMostSeconds);
  }
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job of = RunToShare(connection, run);
  v1::JobSpec spec = SpecOn(connection, of);
  v1::RenderSpec* render = spec.mutable_render();
  SetSideOf(of, render);
  if (wish.max_side_px) render->set_max_side_px(*wish.max_side_px);
  render->set_path(path);
  render->set_bounce(wish.bounce);
  if (wish.seconds) {
    render->set_frames_per_second(kMovieRate);
    render->set_frames(static_cast<int>(std::lround(*wish.seconds * kMovieRate)));
  }
  return SubmitJob(connection, spec);
}

v1::Job ShareCalls::MakeFile(const std::string& run, const std::string& format) const {
  const v1::ExportSpec wanted = ExportOf({format});
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  v1::JobSpec spec = SpecOn(connection, RunToShare(connection, run));
  *spec.mutable_export_() = wanted;
  return SubmitJob(connection, spec);
}

std::string ShareCalls::ColoredPhoto(const std::string& run,
                                     const LocalFile& photo,
                                     int max_side_px) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job of = RunToShare(connection, run);
  LiveSource source;
  const auto has = [&](const char* name) {
    return std::ranges::any_of(of.artifacts(),
                               [&](const v1::Artifact& a) { return a.name() == name; });
  };
  if (has(artifact::kColorizer)) {
    source.colorizer = "colorizers/" + FindArtifact(of, artifact::kColorizer).digest().sha256();
  } else {
    source.example = FindArtifact(of, artifact::kKeyViewColored).digest();
  }
  return LivePng(connection, source, {photo.path, photo.file, std::nullopt}, max_side_px);
}

}  // namespace color3d::client
