#include "server/worker/remote/worker_link.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <string_view>
#include <thread>

#include "core/base/files.h"
#include "core/base/text/address.h"
#include "server/base/service_error.h"
#include "server/rpc/calls/error_mapping.h"

namespace color3d {
namespace {

namespace wire = internal::v1;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::string_view kHttps = "https://";
constexpr milliseconds kFirstPause{50};
constexpr milliseconds kLongestPause{2'000};
constexpr int kMaxMessageBytes = 64 << 20;  // a scene of 10,000 files with long names

std::string ReadPem(const std::filesystem::path& file) {
  return file.empty() ? std::string() : ReadFile(file);
}

std::string HostPortOf(const WorkerTarget& target) {
  return target.address.starts_with(kHttps) ? target.address.substr(kHttps.size()) : target.address;
}

std::shared_ptr<grpc::Channel> MakeChannel(const WorkerTarget& target) {
  const std::string address = HostPortOf(target);
  CheckAddressForm("--server", address);
  const bool is_here = IsLoopback(address);
  const bool is_socket = address.starts_with("unix:");
  if (!target.token.empty() && !target.UsesTls() && !is_here) {
    throw InvalidArgument(
        "the token would be sent to {} unencrypted; give --server https://{}, with --tls-ca if the "
        "server's certificate is self-signed",
        address,
        address);
  }
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  // Also the time that a connection may take, with its TLS handshake.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, is_socket ? 1'000 : 5'000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, is_socket ? 300 : 2'000);
  // A connection without answers is closed after 20 s.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  // Uploads must not delay the heartbeats of another link.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  if (is_here) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto credentials =
      target.UsesTls() ? grpc::SslCredentials(
                             {ReadPem(target.ca), ReadPem(target.key), ReadPem(target.certificate)})
                       : grpc::InsecureChannelCredentials();
  return grpc::CreateCustomChannel(address, credentials, arguments);
}

}  // namespace

bool WorkerTarget::UsesTls() const {
  return address.starts_with(kHttps) || !ca.empty() || !certificate.empty() || !key.empty();
}

LinkTiming LinkTiming::For(milliseconds lease) {
  return {std::max(lease / 6, milliseconds(500)), lease * 2 / 3};
}

void RetryPause::Reset() {
  next_ = kFirstPause;
  end_ = steady_clock::now() + patience_;
}

bool RetryPause::Wait() {
  if (steady_clock::now() + next_ > end_) return false;
  std::this_thread::sleep_for(next_);
  next_ = std::min(next_ * 2, kLongestPause);
  return true;
}

bool IsWorthRetry(const grpc::Status& status) {
  if (status.error_code() != grpc::StatusCode::UNAVAILABLE &&
      status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED &&
      status.error_code() != grpc::StatusCode::CANCELLED) {
    return false;
  }
  // Statuses without details come from the transport.
  if (status.error_details().empty()) return true;
  try {
    ThrowIfFailed(status);
  } catch (const Error& e) {
    return HasReason(e, ErrorReason::kOverloaded) || HasReason(e, ErrorReason::kUploadSilent) ||
           HasReason(e, ErrorReason::kStoreBusy);
  }
  return false;
}

WorkerLink::WorkerLink(const WorkerTarget& target, const LinkTiming& timing)
    : address_(target.address),
      authorization_(target.token.empty() ? "" : "Bearer " + target.token),
      timing_(timing),
      channel_(MakeChannel(target)),
      stub_(wire::WorkerService::NewStub(channel_)) {}

Greeting WorkerLink::Greet(const std::string& release, int32_t protocol) {
  wire::GreetRequest request;
  request.set_protocol(protocol);
  request.set_release(release);
  const wire::GreetResponse response = Retry(&Stub::Greet, request);
  Greeting greeting{FromWire(response), {}};
  for (const wire::Model& model : response.models()) {
    greeting.models[model.name()] = model.sha256();
  }
  return greeting;
}

void WorkerLink::Prepare(grpc::ClientContext* context, milliseconds limit) const {
  // A connection makes progress only while a thread waits for it, and calls that fail at once do
  // not wait.
  if (channel_->GetState(/*try_to_connect=*/true) != GRPC_CHANNEL_READY) {
    channel_->WaitForConnected(std::chrono::system_clock::now() + timing_.call / 2);
  }
  context->set_deadline(std::chrono::system_clock::now() + limit);
  if (!authorization_.empty()) context->AddMetadata("authorization", authorization_);
}

void WorkerLink::Require(const grpc::Status& status) const {
  if (status.error_details().empty() && IsWorthRetry(status)) {
    throw Error(ErrorCode::kUnavailable,
                "the server at {} does not answer: {}",
                address_,
                status.error_message());
  }
  ThrowIfFailed(status);
}

void WorkerLink::RunCall(const std::function<grpc::Status(grpc::ClientContext*)>& call,
                         milliseconds patience) const {
  RetryPause pause(patience);
  while (true) {
    grpc::ClientContext context;
    Prepare(&context, timing_.call);
    const grpc::Status status = call(&context);
    if (!IsWorthRetry(status) || !pause.Wait()) return Require(status);
  }
}

}  // namespace color3d
