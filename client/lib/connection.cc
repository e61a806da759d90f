#include "client/lib/connection.h"

#include <algorithm>
#include <thread>

namespace color3d::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kFirstWait{200};
constexpr milliseconds kLongestWait{3000};
constexpr milliseconds kConnectLimit{4000};
constexpr int kMaxMessageBytes = 64 << 20;  // a scene of 10,000 files with long names

bool IsLoopback(const std::string& address) {
  return address.starts_with("127.") || address.starts_with("localhost") ||
         address.starts_with("[::1]") || address.starts_with("unix:");
}

std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, static_cast<int>(kFirstWait.count()));
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, static_cast<int>(kLongestWait.count()));
  // http_proxy in the environment is not meant for this machine.
  if (IsLoopback(address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

}  // namespace

Backoff::Backoff(milliseconds patience) : patience_(patience) { Reset(); }

void Backoff::Reset() {
  next_ = kFirstWait;
  since_ = steady_clock::now();
}

bool Backoff::Wait(const CancellationToken& cancel) {
  if (steady_clock::now() - since_ > patience_) return false;
  const auto end = steady_clock::now() + next_;
  while (steady_clock::now() < end) {
    cancel.ThrowIfCancelled();
    std::this_thread::sleep_for(std::min(next_, milliseconds(50)));
  }
  cancel.ThrowIfCancelled();
  next_ = std::min(next_ * 2, kLongestWait);
  return true;
}

Connection::Connection(const std::string& address, const CancellationToken& cancel)
    : address_(address), cancel_(cancel), channel_(MakeChannel(address)) {
  const auto end = std::chrono::system_clock::now() + kConnectLimit;
  bool connected = false;
  while (!connected && std::chrono::system_clock::now() < end) {
    cancel.ThrowIfCancelled();
    connected = channel_->WaitForConnected(std::chrono::system_clock::now() + milliseconds(200));
  }
  if (!connected) throw UnreachableError(address);
  scenes_ = v1::SceneService::NewStub(channel_);
  jobs_ = v1::JobService::NewStub(channel_);
  blobs_ = v1::BlobService::NewStub(channel_);
  server_ = v1::ServerService::NewStub(channel_);
  colorizers_ = v1::ColorizerService::NewStub(channel_);
  bytes_ = google::bytestream::ByteStream::NewStub(channel_);
}

void Connection::Retry(const std::function<grpc::Status(grpc::ClientContext*)>& call,
                       std::chrono::seconds time_limit) {
  Backoff backoff;
  while (true) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + time_limit);
    const grpc::Status status = call(&context);
    if (status.ok()) return;
    const RpcError error(status);
    if (error.IsTransient() && backoff.Wait(cancel_)) continue;
    if (error.grpc_code() == grpc::StatusCode::UNAVAILABLE && error.IsUnreachable()) {
      throw UnreachableError(address_);
    }
    throw error;
  }
}

Error UnreachableError(const std::string& address) {
  return Error(ErrorCode::kUnavailable,
               "cannot reach a server at {}: start one with `color3d-server serve --data-dir DIR`, "
               "or name another with --server",
               address);
}

}  // namespace color3d::client
