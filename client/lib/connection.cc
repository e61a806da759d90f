#include "client/lib/connection.h"

#include <grpcpp/support/client_interceptor.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/base/text/address.h"

namespace color3d::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kFirstWait{200};
constexpr milliseconds kLongestWait{3000};
constexpr milliseconds kConnectLimit{4000};
constexpr std::chrono::minutes kPatienceWithFullServer{10};
constexpr std::string_view kHttps = "https://";
constexpr int kMaxMessageBytes = 64 << 20;  // a scene of 10,000 files with long names

using Metadata = std::vector<std::pair<std::string, std::string>>;

// Adds token and trace to every call. Call credentials would add the token over TLS only.
class MetadataBearer : public grpc::experimental::Interceptor {
 public:
  explicit MetadataBearer(const Metadata& metadata) : metadata_(metadata) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      for (const auto& entry : metadata_) methods->GetSendInitialMetadata()->insert(entry);
    }
    methods->Proceed();
  }

 private:
  const Metadata& metadata_;
};

class MetadataBearers : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit MetadataBearers(Metadata metadata) : metadata_(std::move(metadata)) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(
      grpc::experimental::ClientRpcInfo*) override {
    return new MetadataBearer(metadata_);
  }

 private:
  const Metadata metadata_;
};

std::string ReadPem(const std::filesystem::path& file) {
  return file.empty() ? std::string() : ReadFile(file);
}

ServerTarget WithAddress(ServerTarget server) {
  if (server.own_server) server.address = server.own_server();
  return server;
}

std::shared_ptr<grpc::ChannelCredentials> CredentialsFor(const ServerTarget& server) {
  if (!server.UsesTls()) return grpc::InsecureChannelCredentials();
  return grpc::SslCredentials(
      {ReadPem(server.ca), ReadPem(server.key), ReadPem(server.certificate)});
}

std::shared_ptr<grpc::Channel> MakeChannel(const ServerTarget& server) {
  const std::string address = server.HostPort();
  CheckAddressForm("--server", address);
  const bool is_here = IsLoopback(address);
  if (!server.token.empty() && !server.UsesTls() && !is_here) {
    throw InvalidArgument(
        "the token would be sent to {} unencrypted; give --server https://{}, with --ca if the "
        "server's certificate is self-signed",
        address,
        address);
  }
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, static_cast<int>(kFirstWait.count()));
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, static_cast<int>(kLongestWait.count()));
  // A connection without answers is closed after 20 s, not at the time limit of each call.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // http_proxy in the environment does not apply to this machine.
  if (is_here) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  Metadata metadata;
  if (!server.token.empty()) metadata.emplace_back("authorization", "Bearer " + server.token);
  if (!server.traceparent.empty()) metadata.emplace_back("traceparent", server.traceparent);
  if (!metadata.empty()) {
    interceptors.push_back(std::make_unique<MetadataBearers>(std::move(metadata)));
  }
  return grpc::experimental::CreateCustomChannelWithInterceptors(
      address, CredentialsFor(server), arguments, std::move(interceptors));
}

// Internal failures are in the server's log under the id of the call.
RpcError WithRequestId(const RpcError& error,
                       const grpc::Status& status,
                       const grpc::ClientContext& context) {
  const bool is_its_own = status.error_code() == grpc::StatusCode::INTERNAL ||
                          status.error_code() == grpc::StatusCode::DATA_LOSS ||
                          status.error_code() == grpc::StatusCode::UNKNOWN;
  const auto& trailers = context.GetServerTrailingMetadata();
  const auto id = trailers.find("x-request-id");
  if (!is_its_own || id == trailers.end()) return error;
  return RpcError({status.error_code(),
                   status.error_message() + " (request " +
                       std::string(id->second.data(), id->second.size()) + " in the server's log)",
                   status.error_details()});
}

// Error of a call without a connection; over TLS, the reason why the certificate is rejected.
std::string UnreachableReason(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(2));
  v1::ServerInfo info;
  return v1::ServerService::NewStub(channel)->GetServerInfo(&context, {}, &info).error_message();
}

}  // namespace

Backoff::Backoff(milliseconds patience) : patience_(patience) { Reset(); }

void Backoff::Reset() {
  next_ = kFirstWait;
  since_ = steady_clock::now();
}

bool Backoff::Wait(const CancellationToken& cancel, milliseconds at_least) {
  if (steady_clock::now() - since_ > patience_) return false;
  const auto end = steady_clock::now() + std::max(next_, at_least);
  while (steady_clock::now() < end) {
    cancel.ThrowIfCancelled();
    std::this_thread::sleep_for(std::min(next_, milliseconds(50)));
  }
  cancel.ThrowIfCancelled();
  next_ = std::min(next_ * 2, kLongestWait);
  return true;
}

bool FullServerWait::Wait(const RpcError& error, const std::function<bool()>& keep_going) {
  const auto now = steady_clock::now();
  if (!error.IsTurnedAway() || now - since_ > kPatienceWithFullServer) return false;
  connection_.ReportWait(error);
  while (steady_clock::now() < now + error.RetryDelay()) {
    if (keep_going && !keep_going()) return true;
    if (!keep_going) connection_.cancel().ThrowIfCancelled();
    std::this_thread::sleep_for(milliseconds(50));
  }
  return true;
}

bool ServerTarget::UsesTls() const {
  return address.starts_with(kHttps) || !ca.empty() || !certificate.empty() || !key.empty();
}

std::string ServerTarget::HostPort() const {
  return address.starts_with(kHttps) ? address.substr(kHttps.size()) : address;
}

Connection::Connection(const ServerTarget& server, const CancellationToken& cancel)
    : Connection(cancel, WithAddress(server)) {}

Connection::Connection(const CancellationToken& cancel, const ServerTarget& server)
    : address_(server.address),
      on_wait_(server.on_wait),
      patience_(server.patience),
      cancel_(cancel),
      channel_(MakeChannel(server)) {
  const auto end = std::chrono::system_clock::now() + kConnectLimit;
  bool connected = false;
  while (!connected && std::chrono::system_clock::now() < end) {
    cancel.ThrowIfCancelled();
    connected = channel_->WaitForConnected(std::chrono::system_clock::now() + milliseconds(200));
  }
  if (!connected && server.UsesTls()) {
    throw Error(ErrorCode::kUnavailable,
                "cannot reach a server at {} over TLS: {}; check --server, --ca and, if the server "
                "requires one, --client-cert",
                server.address,
                UnreachableReason(channel_));
  }
  if (!connected) throw UnreachableError(server.address);
  scenes_ = v1::SceneService::NewStub(channel_);
  jobs_ = v1::JobService::NewStub(channel_);
  blobs_ = v1::BlobService::NewStub(channel_);
  server_ = v1::ServerService::NewStub(channel_);
  admin_ = v1::AdminService::NewStub(channel_);
  colorizers_ = v1::ColorizerService::NewStub(channel_);
  bytes_ = google::bytestream::ByteStream::NewStub(channel_);
}

void Connection::ReportWait(const RpcError& error) const {
  if (!on_wait_) return;
  on_wait_(std::string(error.what()) + " (waiting " + std::to_string(error.RetryDelay().count()) +
           " s)");
}

void Connection::Retry(const std::function<grpc::Status(grpc::ClientContext*)>& call,
                       std::chrono::seconds time_limit) {
  std::optional<Backoff> backoff;  // starts at the first failure, which may take long to detect
  FullServerWait turned_away(*this);
  while (true) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + time_limit);
    const grpc::Status status = call(&context);
    if (status.ok()) return;
    const RpcError error(status);
    if (!backoff) backoff.emplace(patience_);
    if (error.IsTransient() && backoff->Wait(cancel_, error.RetryDelay())) continue;
    if (turned_away.Wait(error)) continue;
    if (error.grpc_code() == grpc::StatusCode::UNAVAILABLE && error.IsUnreachable()) {
      throw ConnectionLostError(address_);
    }
    throw WithRequestId(error, status, context);
  }
}

v1::ServerInfo GetServerInfo(Connection& connection) {
  return connection.Call(
      &v1::ServerService::Stub::GetServerInfo, connection.server(), v1::GetServerInfoRequest());
}

Error UnreachableError(const std::string& address) {
  return Error(ErrorCode::kUnavailable,
               "cannot reach a server at {}: start one with `color3d-server serve --data-dir DIR`, "
               "or name another with --server",
               address);
}

Error ConnectionLostError(const std::string& address) {
  return Error(ErrorCode::kUnavailable,
               "lost the server at {}; run the command again when it is back (uploaded files are "
               "kept)",
               address);
}

}  // namespace color3d::client
