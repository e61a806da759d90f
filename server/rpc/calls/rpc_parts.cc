#include "server/rpc/calls/rpc_parts.h"

#include <fmt/core.h>

#include <cctype>
#include <set>

#include "core/base/digest.h"
#include "core/trace/trace_context.h"
#include "server/base/service_error.h"
#include "server/planning/job_spec.h"

namespace color3d {
namespace {

double InMib(int64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

}  // namespace

void CheckRequestId(const std::string& request_id) {
  if (request_id.empty()) return;
  bool good = request_id.size() == 36;
  for (size_t i = 0; good && i < request_id.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    good =
        dash ? request_id[i] == '-' : std::isxdigit(static_cast<unsigned char>(request_id[i])) != 0;
  }
  if (!good) {
    throw InvalidArgument(
        "request_id '{}' is not a UUID, e.g. 3f0c9a52-7e4b-4c1d-9b1e-2f6d8a7c5b40",
        request_id.substr(0, 80));
  }
}

Call Admit(const RpcParts& parts, Role role, const grpc::CallbackServerContext& context) {
  const Caller caller = parts.access.Require(role, context);
  // CallWatch has put the span of the call there, if it is recorded.
  const auto given = context.client_metadata().find("traceparent");
  std::optional<TraceContext> trace;
  if (given != context.client_metadata().end()) {
    trace = ParseTraceparent({given->second.data(), given->second.size()});
  }
  return {caller, ProjectStore(parts.store, caller.project), trace ? ToTraceparent(*trace) : ""};
}

void RequireNotDraining(const RpcParts& parts) {
  if (!parts.draining.load()) return;
  throw ServiceError(
      ErrorReason::kDraining,
      "the server is shutting down and takes no new jobs; try again when it is back");
}

bool HasBlob(const RpcParts& parts, const ProjectStore& store, const FileDigest& blob) {
  return store.HoldsBlob(blob) && parts.blobs.Touch(blob);
}

void RequireQuota(const RpcParts& parts, const ProjectStore& store, int64_t more_bytes) {
  const int64_t most = parts.limits.project_max_stored_bytes;
  if (most == 0) return;
  const ProjectRecord usage = store.Usage();
  const int64_t stored = usage.stored_bytes + usage.row_bytes;
  if (stored + more_bytes <= most) return;
  throw ServiceError(
      ErrorReason::kQuotaExceeded,
      fmt::format(
          "your project stores {:.1f} MiB in files and rows of its scenes and jobs; {:.1f} MiB "
          "more would exceed its quota of {:.1f} MiB; delete jobs and scenes that you do not "
          "need",
          InMib(stored),
          InMib(more_bytes),
          InMib(most)),
      {{"project:" + store.project() + " stored_bytes", fmt::format("{} of {}", stored, most)}});
}

void RequireRoomForRows(const RpcParts& parts, const ProjectStore& store, int64_t more_bytes) {
  RequireQuota(parts, store, more_bytes);
  const int64_t free = parts.blobs.FreeBytes();
  // The store's value is some seconds old; FreeBytes is current.
  if (free - more_bytes < parts.limits.low_space_bytes ||
      parts.store.Holds().contains(Hold::kStorage)) {
    throw ServiceError(ErrorReason::kStorageFull,
                       "the server's disk is nearly full ({} MiB are free) and nothing is created; "
                       "free some space there, or try again later",
                       free >> 20);
  }
  parts.blobs.RequireSpace(more_bytes);
}

QueueLimits GetQueueLimits(const RpcParts& parts) {
  const int of_project = parts.limits.project_max_unfinished_jobs;
  return {parts.limits.max_unfinished_jobs, of_project > 0 ? of_project : INT64_MAX};
}

v1::ProjectUsage ToProto(const ProjectRecord& project, const ServiceLimits& limits) {
  v1::ProjectUsage usage;
  usage.set_project(project.name);
  usage.set_stored_bytes(project.stored_bytes + project.row_bytes);
  usage.set_max_stored_bytes(limits.project_max_stored_bytes);
  usage.set_unfinished_jobs(project.unfinished_jobs);
  usage.set_max_unfinished_jobs(limits.project_max_unfinished_jobs);
  usage.set_scenes(project.scenes);
  usage.set_max_scenes(limits.project_max_scenes);
  usage.set_uncommitted_scenes(project.uncommitted_scenes);
  usage.set_max_uncommitted_scenes(limits.project_max_uncommitted_scenes);
  usage.set_weight(project.weight);
  return usage;
}

std::string HoldReason(const RpcParts& parts) {
  const std::set<Hold> holds = parts.store.Holds();
  if (holds.contains(Hold::kPaused)) return "the operator has paused the queue";
  if (holds.contains(Hold::kStorage)) return "the disk is nearly full";
  return "";
}

std::string DigestOfMessage(const google::protobuf::Message& message) {
  return Sha256Hex(DeterministicBytes(message));
}

}  // namespace color3d
