// Dependencies of the RPC services: stores, executors, limits. References outlive the services.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "color3d/v1/server.pb.h"
#include "server/rpc/calls/access.h"
#include "server/rpc/calls/call_memory.h"
#include "server/rpc/calls/error_mapping.h"
#include "server/rpc/calls/executor.h"
#include "server/rpc/calls/job_logs.h"
#include "server/rpc/calls/silence_watch.h"
#include "server/rpc/calls/stream_limit.h"
#include "server/rpc/calls/worker_messages.h"
#include "server/storage/blob_store.h"
#include "server/storage/upload_store.h"
#include "server/store/chore_store.h"
#include "server/store/client_store.h"
#include "server/store/project_store.h"
#include "server/store/user_models.h"

namespace color3d {

struct ServiceLimits {
  int64_t max_blob_bytes = int64_t{8} << 30;
  int max_files_per_scene = 10'000;
  int64_t max_pixels_per_image = 200'000'000;
  int max_image_side_px = 30'000;
  int max_unfinished_jobs = 2'000;
  int max_chunk_bytes = 2 << 20;
  // Maximum numbers of open streams.
  int max_watches = 1'000;
  int max_reads = 256;
  int max_writes = 128;
  // A silent upload or an unread download ends after this time.
  std::chrono::milliseconds stream_silence{60'000};
  int max_connection_calls = 2'000;  // concurrent; further calls wait at the client
  // Memory of unary calls, shared among connections (CallMemory), and of gRPC's own buffers.
  int64_t call_memory_bytes = int64_t{128} << 20;
  int64_t transport_memory_bytes = int64_t{512} << 20;
  // Limits of each project; 0: only the limits above apply.
  int project_max_unfinished_jobs = 0;
  int64_t project_max_stored_bytes = 0;
  int project_max_streams = 0;  // of each kind of stream
  // Limits of each project.
  int64_t project_max_scenes = 10'000;
  int64_t project_max_uncommitted_scenes = 200;
  int64_t max_manifest_bytes = 2 << 20;  // sum of the paths of a scene's files
  // Minimum free space; below it nothing is created.
  int64_t low_space_bytes = 0;
};

// State of a backend as it reports it, or the problem of reaching it.
struct BackendState {
  bool reachable = false;
  bool ready = false;
  std::string description;
  std::vector<std::string> capabilities;
  int64_t max_pixels = 0;
  std::string problem;
};
// Returns states by name. Blocks for at most a few seconds; called from any thread of an executor.
using BackendProbe = std::function<std::map<std::string, BackendState>()>;

struct StreamLimits {
  StreamLimit watches, reads, writes, live;
};

struct RpcParts {
  ClientStore& store;  // of all projects; clients see theirs through Call::store
  ChoreStore& chores;
  WorkerStore& workers;
  BlobStore& blobs;
  UploadStore& uploads;
  Executor& quick;    // reads of the job store and of cached files, e.g. GetJob
  Executor& slow;     // hashing, syncing, writing, remote calls
  Executor& bulk;     // downloads and uploads of blobs; one may hash 8 GiB
  Executor& checks;   // validation of whole scenes
  Executor& errands;  // calls of workers, which clients must not delay
  StreamLimits& streams;
  SilenceWatch& silence;
  CallMemory& memory;
  const Access& access;
  const std::atomic<bool>& draining;
  ServiceLimits limits;
  Clock clock;
  std::string version;
  UserModels models;
  FileDigests& digests;
  BackendProbe probe_backends;
  WorkerTimes worker_times;
  std::shared_ptr<JobLogs> job_logs;        // null: no logs
  std::vector<std::string> notify_allowed;  // see CheckNotifyUrl
  std::function<void()> drain;              // asks the program to end
  std::function<bool()> make_room;          // see RetryAfterMakingRoom; may be empty
};

// An authorized call: caller, store of the caller's project, trace.
struct Call {
  Caller caller;
  ProjectStore store;
  std::string trace;  // W3C traceparent of the call; empty: none
};
// Throws as Access::Require.
Call Admit(const RpcParts& parts, Role role, const grpc::CallbackServerContext& context);

// Throws DRAINING if the server drains.
void RequireNotDraining(const RpcParts& parts);
// Returns whether the project holds the blob and it is stored; then keeps it for the grace period.
bool HasBlob(const RpcParts& parts, const ProjectStore& store, const FileDigest& blob);
// Throws QUOTA_EXCEEDED if `more_bytes` exceed the quota of the project.
void RequireQuota(const RpcParts& parts, const ProjectStore& store, int64_t more_bytes);
// To be called before rows of `more_bytes` are written. Throws QUOTA_EXCEEDED if they exceed the
// quota of the project, STORAGE_FULL if the disk is or would be nearly full.
void RequireRoomForRows(const RpcParts& parts, const ProjectStore& store, int64_t more_bytes);
QueueLimits GetQueueLimits(const RpcParts& parts);
v1::ProjectUsage ToProto(const ProjectRecord& project, const ServiceLimits& limits);
// Returns why workers get no jobs, for people; empty if they do.
std::string HoldReason(const RpcParts& parts);

// Runs `body(caller)`, which reads the request and fills the response, on the executor. `admit()`
// returns the caller and the owner of its queue, or throws. `body` may block and throw.
template <typename Request, typename Response, typename AdmitCaller, typename Body>
grpc::ServerUnaryReactor* AnswerAdmitted(CallMemory& memory,
                                         Executor& executor,
                                         grpc::CallbackServerContext* context,
                                         const Request* request,
                                         Response* response,
                                         const AdmitCaller& admit,
                                         Body body) {
  auto* reactor = new UnaryReactor(memory, context->peer());
  reactor->Hold(*request);
  std::optional<decltype(admit())> admitted;
  const grpc::Status allowed = Guard([&] { admitted = admit(); });
  if (!allowed.ok()) {
    reactor->Finish(allowed);
    return reactor;
  }
  const std::string owner = admitted->second;
  const bool accepted = executor.TryPost(
      [caller = std::move(admitted->first), reactor, response, body] {
        reactor->Finish(Guard([&] {
          reactor->RequireShare();
          body(caller);
          reactor->Hold(*response);
        }));
      },
      owner);
  if (!accepted) reactor->Finish(OverloadedStatus());
  return reactor;
}

// The same with `body(call)`, in the queue of the caller's project, if the caller has the role.
template <typename Request, typename Response, typename Body>
grpc::ServerUnaryReactor* AnswerUnary(const RpcParts& parts,
                                      Executor& executor,
                                      Role role,
                                      grpc::CallbackServerContext* context,
                                      const Request* request,
                                      Response* response,
                                      Body body) {
  const auto admit = [&] {
    Call call = Admit(parts, role, *context);
    std::string project = call.caller.project;
    return std::pair(std::move(call), std::move(project));
  };
  return AnswerAdmitted(parts.memory, executor, context, request, response, admit, std::move(body));
}

// For calls that only read, and for calls that write, hash or sync.
template <typename Request, typename Response, typename Body>
grpc::ServerUnaryReactor* AnswerRead(const RpcParts& parts,
                                     grpc::CallbackServerContext* context,
                                     const Request* request,
                                     Response* response,
                                     Body body) {
  return AnswerUnary(parts, parts.quick, Role::kRead, context, request, response, std::move(body));
}
template <typename Request, typename Response, typename Body>
grpc::ServerUnaryReactor* AnswerWrite(const RpcParts& parts,
                                      grpc::CallbackServerContext* context,
                                      const Request* request,
                                      Response* response,
                                      Body body) {
  return AnswerUnary(parts, parts.slow, Role::kSubmit, context, request, response, std::move(body));
}

// Throws Error{kInvalidArgument} unless it is empty or "8-4-4-4-12" hexadecimal digits.
void CheckRequestId(const std::string& request_id);
std::string DigestOfMessage(const google::protobuf::Message& message);

// Idempotency key of a request: method, request_id, and a digest of all other fields.
template <typename Request>
RequestKey IdempotencyKey(const std::string& method, const Request& request) {
  CheckRequestId(request.request_id());
  if (request.request_id().empty()) return {};
  Request body = request;
  body.clear_request_id();
  return {method, request.request_id(), DigestOfMessage(body)};
}

}  // namespace color3d
