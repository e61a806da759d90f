// What every RPC service is given: stores, executor, limits. References outlive the services.
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
#include "server/rpc/calls/silence_watch.h"
#include "server/rpc/calls/stream_limit.h"
#include "server/storage/blob_store.h"
#include "server/storage/upload_store.h"
#include "server/store/job_store.h"
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
  // Streams that may be open at once.
  int max_watches = 1'000;
  int max_reads = 256;
  int max_writes = 128;
  // An upload that sends nothing, or a download that nobody reads, for so long is ended.
  std::chrono::milliseconds stream_silence{60'000};
  int max_connection_calls = 2'000;  // at once; further ones wait on the client's side
  // Of unary calls, shared among connections (CallMemory), and gRPC's own buffers.
  int64_t call_memory_bytes = int64_t{128} << 20;
  int64_t transport_memory_bytes = int64_t{512} << 20;
  // Of each project; 0: no limit but those above.
  int project_max_unfinished_jobs = 0;
  int64_t project_max_stored_bytes = 0;
  int project_max_streams = 0;  // of each kind
  // Of each project.
  int64_t project_max_scenes = 10'000;
  int64_t project_max_uncommitted_scenes = 200;
  int64_t max_manifest_bytes = 2 << 20;  // the paths of a scene's files, in sum
  // Free space below which nothing is created.
  int64_t low_space_bytes = 0;
};

// What a backend said of itself, or why it did not.
struct BackendState {
  bool reachable = false;
  bool ready = false;
  std::string description;
  std::vector<std::string> capabilities;
  int64_t max_pixels = 0;
  std::string problem;
};
// By name; blocks a few seconds at most, and is called from any thread of an executor.
using BackendProbe = std::function<std::map<std::string, BackendState>()>;

struct StreamLimits {
  StreamLimit watches, reads, writes, live;
};

struct RpcParts {
  JobStore& store;  // of all projects; clients see theirs by Call::store
  BlobStore& blobs;
  UploadStore& uploads;
  Executor& quick;   // reads of the job store and of the disk's cache: what answers GetJob
  Executor& slow;    // what hashes, syncs, writes or asks others
  Executor& bulk;    // blobs on their way: down- and uploads, of which one may hash 8 GiB
  Executor& checks;  // reads whole scenes
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
  std::filesystem::path job_logs;           // folder; empty: there are none
  std::vector<std::string> notify_allowed;  // as CheckNotifyUrl
  std::function<void()> drain;              // asks the program to end
  std::function<bool()> make_room;          // as WithRoomMade; may be empty
};

// One call of somebody who may make it, and what his project sees.
struct Call {
  Caller caller;
  ProjectStore store;
  std::string trace;  // W3C trace id that the call brings; empty: none
};
// Throws as Access::Require.
Call Admit(const RpcParts& parts, Role role, const grpc::CallbackServerContext& context);

// Throws DRAINING.
void RequireNotDraining(const RpcParts& parts);
// Whether the project holds the blob and it is there; it then stays for the time of grace.
bool HasBlob(const RpcParts& parts, const ProjectStore& store, const FileDigest& blob);
// Throws QUOTA_EXCEEDED where the project would have more bytes than it may.
void RequireQuota(const RpcParts& parts, const ProjectStore& store, int64_t more_bytes);
// Before rows of so many bytes are written: throws QUOTA_EXCEEDED where the project would have more
// than it may, STORAGE_FULL where the disk is nearly full or would be.
void RequireRoomForRows(const RpcParts& parts, const ProjectStore& store, int64_t more_bytes);
QueueLimits LimitsOfQueue(const RpcParts& parts);
v1::ProjectUsage ToProto(const ProjectRecord& project, const ServiceLimits& limits);
// Why workers are given no job, for people; empty: they are.
std::string WhyHeld(const RpcParts& parts);

// Answers a unary call from that executor, in the line of the caller's project, where the caller
// has the role: `body(call, request, response)` may block and throw.
template <typename Request, typename Response, typename Body>
grpc::ServerUnaryReactor* AnswerUnary(const RpcParts& parts,
                                      Executor& executor,
                                      Role role,
                                      grpc::CallbackServerContext* context,
                                      const Request* request,
                                      Response* response,
                                      Body body) {
  auto* reactor = new UnaryReactor(parts.memory, context->peer());
  reactor->Hold(*request);
  std::optional<Call> call;
  const grpc::Status allowed = Guard([&] { call = Admit(parts, role, *context); });
  if (!allowed.ok()) {
    reactor->Finish(allowed);
    return reactor;
  }
  const std::string owner = call->caller.project;
  const bool accepted = executor.TryPost(
      [call = *std::move(call), reactor, request, response, body] {
        reactor->Finish(Guard([&] {
          reactor->RequireShare();
          body(call, *request, response);
          reactor->Hold(*response);
        }));
      },
      owner);
  if (!accepted) reactor->Finish(OverloadedStatus());
  return reactor;
}

// For what only looks, and for what writes, hashes or syncs.
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

// "8-4-4-4-12" hexadecimal digits, or empty. Throws Error{kInvalidArgument} otherwise.
void CheckRequestId(const std::string& request_id);
std::string DigestOfMessage(const google::protobuf::Message& message);

// Idempotency key of a request: method, its request_id, and a digest of everything else.
template <typename Request>
RequestKey KeyOf(const std::string& method, const Request& request) {
  CheckRequestId(request.request_id());
  if (request.request_id().empty()) return {};
  Request body = request;
  body.clear_request_id();
  return {method, request.request_id(), DigestOfMessage(body)};
}

}  // namespace color3d
