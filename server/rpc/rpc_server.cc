#include "server/rpc/rpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include <algorithm>

#include "server/net/descriptors.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/blobs/blob_service.h"
#include "server/rpc/info_services.h"
#include "server/rpc/jobs/job_service.h"
#include "server/rpc/scenes/scene_service.h"
#include "server/rpc/workers/worker_service.h"

namespace color3d {
namespace {

constexpr size_t kMaxChecksWaiting = 500;
constexpr int kHandshakeLimitMs = 10'000;
// A connection without calls for this long is closed; clients reconnect when needed.
constexpr int kIdleLimitMs = 5 * 60'000;
// Descriptors besides streams: job store, logs, metrics, gRPC itself, and a margin.
constexpr int kOtherDescriptors = 128;
// A scene of 10,000 files with long names, or a job with as many results.
constexpr int kMaxWorkerMessageBytes = 64 << 20;

}  // namespace

RpcServer::RpcServer(const RpcServerOptions& options,
                     JobStore& store,
                     BlobStore& blobs,
                     UploadStore& uploads,
                     const Clock& clock) {
  sockets_ = std::make_unique<ListenSockets>(options.listen);
  digests_ = std::make_unique<FileDigests>();
  quick_ = std::make_unique<Executor>(options.quick_threads);
  slow_ = std::make_unique<Executor>(options.slow_threads);
  bulk_ = std::make_unique<Executor>(options.bulk_threads);
  checks_ = std::make_unique<Executor>(
      options.check_threads, kMaxChecksWaiting, std::max(1, options.check_threads / 2));
  errands_ = std::make_unique<Executor>(options.errand_threads);
  const int of_project = options.limits.project_max_streams;
  // Without tokens and certificate roles there is only one project.
  const bool shared = options.tokens != nullptr || options.certificates != nullptr;
  streams_.reset(new StreamLimits{{"watches", options.limits.max_watches, of_project, shared},
                                  {"downloads", options.limits.max_reads, of_project, shared},
                                  {"uploads", options.limits.max_writes, of_project, shared},
                                  {"live streams", options.live.max_streams, of_project, shared}});
  silence_ = std::make_unique<SilenceWatch>(options.limits.stream_silence);
  memory_ = std::make_unique<CallMemory>(options.limits.call_memory_bytes);
  worker_memory_ = std::make_unique<CallMemory>(options.limits.call_memory_bytes);
  access_ = std::make_unique<Access>(options.tokens, options.certificates);
  parts_.reset(new RpcParts{store,
                            store,
                            store,
                            blobs,
                            uploads,
                            *quick_,
                            *slow_,
                            *bulk_,
                            *checks_,
                            *errands_,
                            *streams_,
                            *silence_,
                            *memory_,
                            *access_,
                            draining_,
                            options.limits,
                            clock,
                            options.version,
                            options.models,
                            *digests_,
                            options.probe_backends,
                            options.worker_times,
                            options.job_logs,
                            options.notify_allowed,
                            options.drain,
                            options.make_room});
  hub_ = std::make_unique<WatchHub>(*parts_, options.watch);
  colorize_hub_ = std::make_unique<ColorizeHub>(*parts_, options.inference, options.live);
  services_.push_back(MakeSceneService(*parts_));
  services_.push_back(MakeBlobService(*parts_));
  services_.push_back(MakeByteStreamService(*parts_));
  services_.push_back(MakeJobService(*parts_, *hub_));
  services_.push_back(MakeColorizerService(*parts_, *colorize_hub_));
  services_.push_back(MakeServerService(*parts_));
  services_.push_back(MakeAdminService(*parts_));
  services_.push_back(MakeWorkerService(*parts_, WorkerPlace::kElsewhere, *memory_));
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  // gRPC gets accepted connections and does not listen itself: it would stop listening for good
  // once the process has run out of descriptors.
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      options.credentials ? options.credentials : grpc::InsecureServerCredentials());
  MakeGate(options);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeLimitMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kIdleLimitMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 60'000);
  builder.SetMaxReceiveMessageSize(16 << 20);
  // Memory of gRPC for connections and calls; beyond it no connection is accepted.
  grpc::ResourceQuota quota("rpc");
  quota.Resize(static_cast<size_t>(options.limits.transport_memory_bytes));
  builder.SetResourceQuota(quota);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.limits.max_connection_calls);
  for (const auto& service : services_) builder.RegisterService(service.get());
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(MakeCallWatch(options.on_call,
                                       {[this](const std::string& peer) { gate_->BeginCall(peer); },
                                        [this](const std::string& peer) { gate_->EndCall(peer); }},
                                       options.tracer));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  server_ = builder.BuildAndStart();
  if (!server_) {
    throw Error(ErrorCode::kFailedPrecondition,
                "gRPC cannot answer on {}; choose another with --listen",
                options.listen);
  }
  if (!options.worker_socket.empty()) ListenToWorkers(options.worker_socket);
  gate_->Open();
}

void RpcServer::ListenToWorkers(const std::string& socket) {
  services_.push_back(MakeWorkerService(*parts_, WorkerPlace::kHere, *worker_memory_));
  grpc::ServerBuilder builder;
  builder.AddListeningPort(socket, grpc::InsecureServerCredentials());
  builder.SetMaxReceiveMessageSize(kMaxWorkerMessageBytes);
  builder.RegisterService(services_.back().get());
  worker_server_ = builder.BuildAndStart();
  if (worker_server_) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "cannot listen to workers on {}; the file system of --data-dir must allow sockets",
              socket);
}

void RpcServer::MakeGate(const RpcServerOptions& options) {
  const int reserve = options.limits.max_reads + options.limits.max_writes + kOtherDescriptors;
  const GateLimits limits = GateLimitsFor(DescriptorLimit(), reserve, options.max_connections);
  gate_ = std::make_unique<ConnectionGate>(*sockets_, limits, [this](int listener, int fd) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.listener_fd = listener;
    connection.fd = fd;
    acceptor_->HandleNewConnection(&connection);
  });
}

const std::string& RpcServer::address() const { return sockets_->address(); }

ConnectionGate::Counts RpcServer::connections() const { return gate_->counts(); }

RpcServer::~RpcServer() { Shutdown(std::chrono::milliseconds(0)); }

RpcServer::Open RpcServer::open() const {
  return {streams_->watches.open(),
          streams_->reads.open(),
          streams_->writes.open(),
          colorize_hub_->pictures()};
}

void RpcServer::StartDraining() {
  draining_ = true;
  server_->GetHealthCheckService()->SetServingStatus(false);
  hub_->Drain();
  colorize_hub_->Drain();
}

void RpcServer::Shutdown(std::chrono::milliseconds grace) {
  if (!server_) return;
  gate_->Stop();
  sockets_->Close();
  hub_->Drain();
  colorize_hub_->Drain();
  server_->Shutdown(std::chrono::system_clock::now() + grace);
  server_->Wait();
  server_.reset();
  if (worker_server_) {
    worker_server_->Shutdown(std::chrono::system_clock::now() + grace);
    worker_server_->Wait();
    worker_server_.reset();
  }
  hub_.reset();  // all its streams have ended
  quick_.reset();
  slow_.reset();
  bulk_.reset();
  checks_.reset();
  errands_.reset();
}

}  // namespace color3d
