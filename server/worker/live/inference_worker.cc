#include "server/worker/live/inference_worker.h"

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <memory>
#include <thread>

#include "core/base/memory.h"
#include "server/ops/socket_folder.h"
#include "server/storage/data_folder.h"
#include "server/worker/live/inference_queue.h"
#include "server/worker/remote/remote_store.h"

namespace color3d {
namespace {

constexpr auto kLook = std::chrono::milliseconds(50);
constexpr auto kReport = std::chrono::seconds(5);

class InferenceWorker {
 public:
  InferenceWorker(const InferenceOptions& options,
                  LiveEngine& engine,
                  const std::atomic<bool>& draining)
      : options_(options),
        id_(options.name + "-" + std::to_string(::getpid())),
        sockets_(DataPaths(options.data_folder).Sockets()),
        link_({sockets_.Address(kWorkerSocket)}, {std::chrono::seconds(2), {}}),
        store_(link_, ""),
        draining_(draining),
        queue_(engine, options.max_batch, options.max_waiting) {}

  void Run();

 private:
  void Listen();
  bool ShouldEnd() const;
  void GiveUpIfStuck() const;
  void Report();

  const InferenceOptions options_;
  const std::string id_;
  const SocketFolder sockets_;
  WorkerLink link_;
  RemoteStore store_;
  const std::atomic<bool>& draining_;
  InferenceQueue queue_;
  std::unique_ptr<grpc::Server> server_;
};

void InferenceWorker::Listen() {
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(
      sockets_.Address(options_.socket), grpc::InsecureServerCredentials(), &port);
  builder.SetMaxReceiveMessageSize(8 << 20);
  builder.RegisterService(&queue_);
  server_ = builder.BuildAndStart();
  if (server_) return;
  throw Error(
      ErrorCode::kFailedPrecondition,
      "cannot listen on the socket {} in {}; the file system of --data-dir must allow sockets",
      options_.socket,
      DataPaths(options_.data_folder).Sockets().string());
}

bool InferenceWorker::ShouldEnd() const {
  if (draining_.load() || (options_.parent != 0 && ::getppid() != options_.parent)) return true;
  const InferenceQueue::State state = queue_.state();
  if (!state.idle) return false;
  if (state.since > options_.idle) {
    spdlog::info("{} ends: there was nothing to colour", id_);
    return true;
  }
  const int64_t memory = ResidentMemoryBytes();
  if (memory <= options_.recycle_memory_bytes || state.since < kReport) return false;
  spdlog::info("{} ends with {} MiB, to be restarted on demand", id_, memory >> 20);
  return true;
}

void InferenceWorker::GiveUpIfStuck() const {
  if (queue_.state().batch < options_.stuck) return;
  spdlog::critical("{}: a batch does not end; giving up", id_);
  spdlog::shutdown();
  ::_exit(1);
}

void InferenceWorker::Report() {
  try {
    store_.UpdateWorker({id_, ::getpid(), "", ResidentMemoryBytes(), 0});
  } catch (const Error& e) {
    spdlog::warn("{}: {}", id_, e.what());
  }
}

void InferenceWorker::Run() {
  Listen();
  spdlog::info("{} is ready", id_);
  auto next_report = std::chrono::steady_clock::now();
  while (!ShouldEnd()) {
    GiveUpIfStuck();
    if (std::chrono::steady_clock::now() >= next_report) {
      Report();
      next_report = std::chrono::steady_clock::now() + kReport;
    }
    std::this_thread::sleep_for(kLook);
  }
  // Accepts no new calls and waits for the present ones.
  server_->Shutdown(std::chrono::system_clock::now() + options_.drain_grace);
  try {
    store_.RemoveWorker(id_);
  } catch (const Error& e) {
    spdlog::warn("{}: {}", id_, e.what());
  }
}

}  // namespace

void RunInference(const InferenceOptions& options,
                  LiveEngine& engine,
                  const std::atomic<bool>& draining) {
  InferenceWorker worker(options, engine, draining);
  worker.Run();
}

}  // namespace color3d
