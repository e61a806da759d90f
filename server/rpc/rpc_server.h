// All gRPC services on one port. Owns the services, the executors and the watch hub.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <string>

#include "server/net/connection_gate.h"
#include "server/net/listen_sockets.h"
#include "server/rpc/calls/call_watch.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/jobs/watch_hub.h"
#include "server/rpc/live/colorize_hub.h"

namespace grpc {
class Server;
namespace experimental {
class ExternalConnectionAcceptor;
}
}  // namespace grpc

namespace color3d {

struct RpcServerOptions {
  std::string listen = "127.0.0.1:50551";  // port 0: any free one
  int quick_threads = 4;
  int slow_threads = 6;
  int bulk_threads = 6;
  int check_threads = 4;                                 // of which one project has half at most
  std::shared_ptr<grpc::ServerCredentials> credentials;  // null: in the clear
  // Both null: nobody is asked.
  std::shared_ptr<TokenBook> tokens;
  std::shared_ptr<CertificateRoles> certificates;
  ServiceLimits limits;
  int max_connections = 4096;  // fewer where the process may not have so many descriptors
  WatchTiming watch;
  std::string version = "0";
  UserModels models;
  BackendProbe probe_backends;              // may be empty: then backends are listed unprobed
  std::filesystem::path job_logs;           // folder of DataPaths::JobLogs; empty: there are none
  std::vector<std::string> notify_allowed;  // as CheckNotifyUrl
  std::function<void()> drain = [] {};      // what AdminService.Drain does
  std::function<bool()> make_room;          // gives disk space up for a deletion; may be empty
  CallObserver on_call;                     // may be empty
  InferenceLink inference;
  ColorizeLimits live;
};

class RpcServer {
 public:
  // Starts to answer. Throws Error{kFailedPrecondition} when the address is in use or no address of
  // this machine, in one line with the remedy. The stores outlive the server.
  RpcServer(const RpcServerOptions& options,
            JobStore& store,
            BlobStore& blobs,
            UploadStore& uploads,
            const Clock& clock);
  ~RpcServer();
  RpcServer(const RpcServer&) = delete;
  RpcServer& operator=(const RpcServer&) = delete;

  // "127.0.0.1:50551" with the port that was bound.
  const std::string& address() const;
  // Streams that are open, and pictures that are not answered yet.
  struct Open {
    int watches = 0, downloads = 0, uploads = 0, live_pictures = 0;
  };
  Open open() const;
  ConnectionGate::Counts connections() const;
  // Health turns NOT_SERVING, new jobs are refused, streams end with UNAVAILABLE.
  void StartDraining();
  // Waits for open RPCs at most this long, then cancels them.
  void Shutdown(std::chrono::milliseconds grace);

 private:
  struct Services;
  void MakeGate(const RpcServerOptions& options);

  std::unique_ptr<ListenSockets> sockets_;
  std::atomic<bool> draining_{false};
  std::unique_ptr<FileDigests> digests_;
  std::unique_ptr<Executor> quick_, slow_, bulk_, checks_;
  std::unique_ptr<StreamLimits> streams_;
  std::unique_ptr<SilenceWatch> silence_;
  std::unique_ptr<CallMemory> memory_;
  std::unique_ptr<Access> access_;
  std::unique_ptr<RpcParts> parts_;
  std::unique_ptr<WatchHub> hub_;
  std::unique_ptr<ColorizeHub> colorize_hub_;
  std::unique_ptr<Services> services_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<ConnectionGate> gate_;  // calls of the server tell it
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace color3d
