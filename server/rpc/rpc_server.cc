#include "server/rpc/rpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/base/address.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/blob_service.h"
#include "server/rpc/info_services.h"
#include "server/rpc/job_service.h"
#include "server/rpc/scene_service.h"

namespace color3d {
namespace {

constexpr size_t kMaxChecksWaiting = 500;

// gRPC does not say why it could not bind: try it with a plain socket first.
void CheckAddress(const std::string& listen) {
  if (listen.rfind("unix:", 0) == 0) return;
  const HostPort address = SplitHostPort(listen);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int failed = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found);
  if (failed != 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot listen on {}: {}; choose another with --listen",
                listen,
                ::gai_strerror(failed));
  }
  const int fd = ::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  const bool bound = ::bind(fd, found->ai_addr, found->ai_addrlen) == 0 && ::listen(fd, 1) == 0;
  const int error = errno;
  ::close(fd);
  ::freeaddrinfo(found);
  if (bound) return;
  const std::string why = error == EADDRINUSE ? "the address is in use (is another server running?)"
                                              : std::string(std::strerror(error));
  throw Error(ErrorCode::kFailedPrecondition,
              "cannot listen on {}: {}; choose another with --listen",
              listen,
              why);
}

}  // namespace

struct RpcServer::Services {
  Services(const RpcParts& parts, WatchHub& hub, ColorizeHub& colorize_hub)
      : scenes(parts),
        blobs(parts),
        bytes(parts),
        jobs(parts, hub),
        colorizers(parts, colorize_hub),
        server(parts),
        admin(parts) {}
  SceneServiceImpl scenes;
  BlobServiceImpl blobs;
  ByteStreamServiceImpl bytes;
  JobServiceImpl jobs;
  ColorizerServiceImpl colorizers;
  ServerServiceImpl server;
  AdminServiceImpl admin;
};

RpcServer::RpcServer(const RpcServerOptions& options,
                     JobStore& store,
                     BlobStore& blobs,
                     UploadStore& uploads,
                     const Clock& clock) {
  CheckAddress(options.listen);
  digests_ = std::make_unique<FileDigests>();
  quick_ = std::make_unique<Executor>(options.quick_threads);
  slow_ = std::make_unique<Executor>(options.slow_threads);
  bulk_ = std::make_unique<Executor>(options.bulk_threads);
  checks_ = std::make_unique<Executor>(
      options.check_threads, kMaxChecksWaiting, std::max(1, options.check_threads / 2));
  const int of_project = options.limits.project_max_streams;
  streams_.reset(new StreamLimits{{"watches", options.limits.max_watches, of_project},
                                  {"downloads", options.limits.max_reads, of_project},
                                  {"uploads", options.limits.max_writes, of_project},
                                  {"live streams", options.live.max_streams, of_project}});
  memory_ = std::make_unique<CallMemory>(options.limits.call_memory_bytes);
  access_ = std::make_unique<Access>(options.tokens);
  parts_.reset(new RpcParts{store,
                            blobs,
                            uploads,
                            *quick_,
                            *slow_,
                            *bulk_,
                            *checks_,
                            *streams_,
                            *memory_,
                            *access_,
                            draining_,
                            options.limits,
                            clock,
                            options.version,
                            options.models,
                            *digests_,
                            options.probe_backends,
                            options.job_logs,
                            options.notify_allowed,
                            options.drain,
                            options.make_room});
  hub_ = std::make_unique<WatchHub>(*parts_, options.watch);
  colorize_hub_ = std::make_unique<ColorizeHub>(*parts_, options.inference, options.live);
  services_ = std::make_unique<Services>(*parts_, *hub_, *colorize_hub_);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(
      options.listen,
      options.credentials ? options.credentials : grpc::InsecureServerCredentials(),
      &port);
  // Without this two servers could share a port, each answering half of the calls.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 60'000);
  builder.SetMaxReceiveMessageSize(16 << 20);
  // What gRPC itself keeps of connections and calls: beyond it no connection is accepted.
  grpc::ResourceQuota quota("rpc");
  quota.Resize(static_cast<size_t>(options.limits.transport_memory_bytes));
  builder.SetResourceQuota(quota);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.limits.max_connection_calls);
  for (grpc::Service* service : {static_cast<grpc::Service*>(&services_->scenes),
                                 static_cast<grpc::Service*>(&services_->blobs),
                                 static_cast<grpc::Service*>(&services_->bytes),
                                 static_cast<grpc::Service*>(&services_->jobs),
                                 static_cast<grpc::Service*>(&services_->colorizers),
                                 static_cast<grpc::Service*>(&services_->server),
                                 static_cast<grpc::Service*>(&services_->admin)}) {
    builder.RegisterService(service);
  }
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(MakeCallWatch(options.on_call));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  server_ = builder.BuildAndStart();
  if (!server_) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot listen on {}; choose another with --listen",
                options.listen);
  }
  address_ = options.listen.rfind("unix:", 0) == 0
                 ? options.listen
                 : options.listen.substr(0, options.listen.rfind(':') + 1) + std::to_string(port);
}

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
  hub_->Drain();
  colorize_hub_->Drain();
  server_->Shutdown(std::chrono::system_clock::now() + grace);
  server_->Wait();
  server_.reset();
  hub_.reset();  // its streams are all done now
  quick_.reset();
  slow_.reset();
  bulk_.reset();
  checks_.reset();
}

}  // namespace color3d
