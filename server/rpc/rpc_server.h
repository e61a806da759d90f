// All gRPC services on one port. Owns the services, the executors and the watch hub.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/net/connection_gate.h"
#include "server/net/listen_sockets.h"
#include "server/rpc/calls/call_watch.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/jobs/watch_hub.h"
#include "server/rpc/live/colorize_hub.h"
#include "server/store/job_store.h"

namespace grpc {
class Server;
class Service;
namespace experimental {
class ExternalConnectionAcceptor;
}
}  // namespace grpc

namespace color3d {

struct RpcServerOptions {
  std::string listen = "127.0.0.1:50551";  // port 0: any free port
  int quick_threads = 4;
  int slow_threads = 6;
  int bulk_threads = 6;
  int errand_threads = 4;                                // calls of workers
  int check_threads = 4;                                 // one project uses at most half of them
  std::shared_ptr<grpc::ServerCredentials> credentials;  // null: no TLS
  // Both null: no authentication.
  std::shared_ptr<TokenBook> tokens;
  std::shared_ptr<CertificateRoles> certificates;
  ServiceLimits limits;
  int max_connections = 4096;  // fewer if the process may not open as many descriptors
  WatchTiming watch;
  std::string version = "0";
  UserModels models;
  BackendProbe probe_backends;              // empty: backends are listed without probing
  std::shared_ptr<JobLogs> job_logs;        // null: no logs
  std::vector<std::string> notify_allowed;  // see CheckNotifyUrl
  std::function<void()> drain = [] {};      // called by AdminService.Drain
  std::function<bool()> make_room;          // frees disk space for a deletion; may be empty
  CallObserver on_call;                     // may be empty
  InferenceLink inference;
  ColorizeLimits live;
  std::string worker_socket;  // gRPC address for workers on this machine; empty: none
  WorkerTimes worker_times;
  std::shared_ptr<Tracer> tracer;  // records calls; null: does not
};

class RpcServer {
 public:
  // Starts to serve. Throws Error{kFailedPrecondition} with the remedy if the address is in use or
  // does not belong to this machine. The stores must outlive the server.
  RpcServer(const RpcServerOptions& options,
            JobStore& store,
            BlobStore& blobs,
            UploadStore& uploads,
            const Clock& clock);
  ~RpcServer();
  RpcServer(const RpcServer&) = delete;
  RpcServer& operator=(const RpcServer&) = delete;

  // Address with the bound port, e.g. "127.0.0.1:50551".
  const std::string& address() const;
  // Numbers of open streams and of pictures not answered yet.
  struct Open {
    int watches = 0, downloads = 0, uploads = 0, live_pictures = 0;
  };
  Open open() const;
  ConnectionGate::Counts connections() const;
  // Sets health to NOT_SERVING, refuses new jobs and ends streams with UNAVAILABLE.
  void StartDraining();
  // Waits at most `grace` for open RPCs, then cancels them. The workers' socket closes last.
  void Shutdown(std::chrono::milliseconds grace);

 private:
  void MakeGate(const RpcServerOptions& options);
  void ListenToWorkers(const std::string& socket);

  std::unique_ptr<ListenSockets> sockets_;
  std::atomic<bool> draining_{false};
  std::unique_ptr<FileDigests> digests_;
  std::unique_ptr<Executor> quick_, slow_, bulk_, checks_, errands_;
  std::unique_ptr<StreamLimits> streams_;
  std::unique_ptr<SilenceWatch> silence_;
  std::unique_ptr<CallMemory> memory_, worker_memory_;
  std::unique_ptr<Access> access_;
  std::unique_ptr<RpcParts> parts_;
  std::unique_ptr<WatchHub> hub_;
  std::unique_ptr<ColorizeHub> colorize_hub_;
  std::vector<std::unique_ptr<grpc::Service>> services_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<ConnectionGate> gate_;  // notified of calls by the server
  std::unique_ptr<grpc::Server> server_, worker_server_;
};

}  // namespace color3d
