#include "client/commands/colored_scene.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/text.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

const v1::Artifact* FindModel(const v1::Job& job) {
  const auto found = std::ranges::find_if(
      job.artifacts(), [](const v1::Artifact& a) { return a.name() == artifact::kModel; });
  return found != job.artifacts().end() ? &*found : nullptr;
}

[[noreturn]] void RejectFilm(const std::string& results) {
  throw Error(
      ErrorCode::kFailedPrecondition,
      "{}: this film was coloured without poses, so no camera can move through it. Its "
      "coloured frames are {} among the results (for pictures run the command again with --png; "
      "finished stages are not repeated). For a scene to move through, colour a film of one "
      "moving camera with --film --poses",
      results,
      artifact::kMovie);
}

v1::Job RequireModel(v1::Job job) {
  if (job.state() != v1::Job::STATE_SUCCEEDED) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} has no results: it is {}; see `color3d job show {}`",
                job.name(),
                StateName(job.state()),
                job.name());
  }
  if (FindModel(job) != nullptr) return job;
  if (job.kind() == kind::kColorizeScene) RejectFilm(job.name());
  throw Error(ErrorCode::kFailedPrecondition,
              "{} is a {} job and has no {}; name a {} job",
              job.name(),
              job.kind(),
              artifact::kModel,
              kind::kColorizeScene);
}

fs::path FindModelFile(const fs::path& folder) {
  if (!IsFolder(folder)) {
    throw Error(ErrorCode::kNotFound,
                "there is no folder {}; name the one that `color3d colorize` wrote to (-o), "
                "jobs/ID or scenes/ID",
                folder.string());
  }
  const fs::path model = folder / artifact::kModel;
  if (IsFile(model)) return model;
  if (IsFile(folder / artifact::kReport) && IsFile(folder / artifact::kMovie)) {
    RejectFilm(folder.string());
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "{} has no {}: it holds no finished results of `color3d colorize`; when the job is "
              "done, fetch them with `color3d artifact download jobs/ID -o {}`",
              folder.string(),
              artifact::kModel,
              folder.string());
}

v1::Job FindJobOfModel(Connection& connection, const fs::path& model) {
  const FileDigest digest = DigestFile(model);
  std::optional<v1::Job> found;
  ForEachJob(connection, "", [&](const v1::Job& job) {
    if (job.state() != v1::Job::STATE_SUCCEEDED || !job.parent().empty()) return true;
    const v1::Artifact* theirs = FindModel(job);
    if (theirs != nullptr && theirs->digest().sha256() == digest.sha256) found = job;
    return !found;
  });
  if (found) return *std::move(found);
  throw Error(ErrorCode::kFailedPrecondition,
              "no job of the server at {} made {}; name the server that has it with --server, "
              "or colour the scene again",
              connection.address(),
              model.string());
}

}  // namespace

bool IsOnServer(const std::string& target) {
  std::error_code none;
  return (target.starts_with("scenes/") || target.starts_with("jobs/")) &&
         !fs::exists(target, none);
}

v1::Job NewestResult(Connection& connection, const std::string& scene) {
  GetScene(connection, scene);
  std::optional<v1::Job> newest;
  std::string unfinished;
  ForEachJob(connection, scene, [&](const v1::Job& job) {
    if (job.kind() != kind::kColorizeScene || !job.parent().empty()) return true;
    if (job.state() == v1::Job::STATE_SUCCEEDED) newest = job;
    if (unfinished.empty() && !IsFinished(job.state())) unfinished = job.name();
    return !newest;
  });
  if (newest) return *std::move(newest);
  if (!unfinished.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} is still being coloured; follow it with `color3d job watch {}`",
                scene,
                unfinished);
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "{} is not coloured yet; run `color3d colorize {}`",
              scene,
              scene);
}

v1::Job FindColoredScene(Connection& connection, const std::string& target) {
  if (!IsOnServer(target)) return FindJobOfModel(connection, FindModelFile(target));
  if (target.starts_with("scenes/")) return RequireModel(NewestResult(connection, target));
  return RequireModel(GetJob(connection, ResourceName(target, "jobs")));
}

}  // namespace color3d::client
