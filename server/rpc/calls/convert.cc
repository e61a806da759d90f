#include "server/rpc/calls/convert.h"

#include <fmt/core.h>

#include <charconv>

#include "core/base/text/utf8.h"
#include "server/base/service_error.h"
#include "server/planning/job_spec.h"
#include "server/rpc/calls/error_mapping.h"

namespace color3d {

google::protobuf::Timestamp ToTimestamp(int64_t ms) {
  google::protobuf::Timestamp timestamp;
  timestamp.set_seconds(ms / 1000);
  timestamp.set_nanos(static_cast<int32_t>(ms % 1000) * 1'000'000);
  return timestamp;
}

v1::Digest ToProto(const FileDigest& digest) {
  v1::Digest proto;
  proto.set_sha256(digest.sha256);
  proto.set_size_bytes(digest.size_bytes);
  return proto;
}

v1::Scene ToProto(const SceneRecord& scene) {
  v1::Scene proto;
  proto.set_name(scene.name);
  proto.set_display_name(scene.display_name);
  proto.set_state(scene.state == SceneState::kActive ? v1::Scene::STATE_ACTIVE
                                                     : v1::Scene::STATE_UPLOADING);
  proto.set_layout(static_cast<v1::Scene::Layout>(scene.layout));
  for (const SceneFileRecord& file : scene.files) {
    v1::SceneFile* entry = proto.add_files();
    entry->set_path(file.path);
    *entry->mutable_digest() = ToProto(file.digest);
  }
  proto.set_photo_count(scene.photo_count);
  proto.set_key_color_job(scene.key_color_job);
  *proto.mutable_create_time() = ToTimestamp(scene.create_ms);
  if (scene.commit_ms != 0) *proto.mutable_commit_time() = ToTimestamp(scene.commit_ms);
  return proto;
}

v1::Job::State StateToProto(JobState state) {
  return static_cast<v1::Job::State>(static_cast<int>(state) + 1);
}

v1::Job ToProgressProto(const JobRecord& job) {
  v1::Job proto;
  proto.set_name(job.name);
  proto.set_parent(job.parent);
  proto.set_kind(job.kind);
  proto.set_state(StateToProto(job.state));
  proto.set_attempt(job.attempt);
  proto.set_revision(job.revision);
  v1::Progress* progress = proto.mutable_progress();
  progress->set_step(job.progress.step);
  progress->set_total_steps(job.progress.total_steps);
  progress->set_message(CleanUtf8(job.progress.message));
  progress->set_error_name(CleanUtf8(job.progress.error_name));
  progress->set_error_value(job.progress.error_value);
  progress->set_seconds(job.usage.seconds);
  progress->set_eta_seconds(job.progress.eta_seconds);
  return proto;
}

v1::Job ToProto(const JobRecord& job) {
  v1::Job proto = ToProgressProto(job);
  *proto.mutable_spec() = ParseSpec(job.spec, job.name);
  proto.set_cancel_requested(job.cancel_requested);
  proto.set_max_attempts(job.max_attempts);
  for (const ArtifactRecord& artifact : job.artifacts) {
    v1::Artifact* entry = proto.add_artifacts();
    entry->set_name(artifact.name);
    *entry->mutable_digest() = ToProto(artifact.digest);
    entry->set_media_type(artifact.media_type);
  }
  if (job.error) *proto.mutable_error() = ToRpcStatus(*job.error);
  proto.set_skip_reason(CleanUtf8(job.skip_reason));
  proto.set_cached(job.cached);
  for (const std::string& warning : job.usage.warnings) proto.add_warnings(CleanUtf8(warning));
  *proto.mutable_create_time() = ToTimestamp(job.create_ms);
  if (job.start_ms != 0) *proto.mutable_start_time() = ToTimestamp(job.start_ms);
  if (job.end_ms != 0) *proto.mutable_end_time() = ToTimestamp(job.end_ms);
  proto.set_worker(job.worker);
  proto.set_peak_memory_bytes(job.usage.peak_memory_bytes);
  proto.set_queued_seconds(static_cast<double>(job.queued_ms) / 1000.0);
  proto.set_pinned(job.pinned);
  if (job.deadline_ms != kNoDeadline) *proto.mutable_deadline() = ToTimestamp(job.deadline_ms);
  return proto;
}

v1::Colorizer ToProto(const ColorizerRecord& colorizer) {
  v1::Colorizer proto;
  proto.set_name("colorizers/" + colorizer.digest.sha256);
  proto.set_scene(colorizer.scene);
  proto.set_job(colorizer.job);
  *proto.mutable_file() = ToProto(colorizer.digest);
  *proto.mutable_create_time() = ToTimestamp(colorizer.create_ms);
  return proto;
}

void CheckName(std::string_view name, std::string_view collection) {
  constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyz0123456789-";
  const bool prefixed = name.size() > collection.size() + 1 &&
                        name.substr(0, collection.size()) == collection &&
                        name[collection.size()] == '/';
  const std::string_view id = prefixed ? name.substr(collection.size() + 1) : "";
  if (id.empty() || id.size() > 64 || id.find_first_not_of(kAllowed) != std::string_view::npos) {
    throw InvalidArgument("the name '{}' must be '{}/{{id}}'", name.substr(0, 100), collection);
  }
}

FileDigest FromProto(const v1::Digest& digest) {
  if (!IsSha256Hex(digest.sha256())) {
    throw InvalidArgument("'{}' is not a SHA-256 digest: 64 lower-case hexadecimal digits",
                          digest.sha256().substr(0, 80));
  }
  if (digest.size_bytes() < 0) {
    throw InvalidArgument("the digest {} has the size {}; it must not be negative",
                          digest.sha256(),
                          digest.size_bytes());
  }
  return {digest.sha256(), digest.size_bytes()};
}

std::string MakePageToken(int64_t last_id, const std::string& listing) {
  return fmt::format("{}.{}", last_id, Sha256Hex(listing).substr(0, 8));
}

int64_t ParsePageToken(const std::string& token, const std::string& listing) {
  if (token.empty()) return 0;
  int64_t id = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), id);
  if (error != std::errc() || id < 1 || token != MakePageToken(id, listing)) {
    throw InvalidArgument("page_token '{}' does not belong to this listing; start without one",
                          token.substr(0, 80));
  }
  return id;
}

int PageSize(int requested) {
  if (requested < 0 || requested > 1000) {
    throw InvalidArgument("page_size is {}; the range is 1 to 1000, 0 means 50", requested);
  }
  return requested == 0 ? 50 : requested;
}

}  // namespace color3d
