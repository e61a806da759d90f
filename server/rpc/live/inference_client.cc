#include "server/rpc/live/inference_client.h"

#include <fmt/core.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "server/base/service_error.h"
#include "server/rpc/calls/error_mapping.h"
#include "server/rpc/calls/rpc_parts.h"

namespace color3d {
namespace {

using std::chrono::system_clock;

std::shared_ptr<grpc::Channel> MakeChannel(const std::string& target) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A worker takes a second or two to start, so reconnect often.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 300);
  // A picture that kills a worker must not be retried by gRPC.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  // Each worker has a connection of its own.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(target, grpc::InsecureChannelCredentials(), arguments);
}

// Statuses without details come from the transport, not from the worker.
grpc::Status ExplainStatus(const grpc::Status& status, bool our_limit) {
  if (status.ok() || !status.error_details().empty()) return status;
  if (status.error_code() == grpc::StatusCode::CANCELLED) return status;
  const bool late = status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
  if (late && !our_limit) return status;
  const std::string what =
      late
          ? "the inference worker did not answer in time (it is busy, or cannot start: see its log)"
          : fmt::format("the inference worker ended before it had coloured this picture ({})",
                        status.error_message());
  return ToGrpcStatus(
      ServiceError(ErrorReason::kInferenceLost, "{}; send the picture again", what));
}

// A status without details comes from the transport, after the worker was reached.
PoisonWatch::End ClassifyEnd(const grpc::Status& status) {
  if (status.ok() || !status.error_details().empty()) return PoisonWatch::End::kAnswered;
  return status.error_code() == grpc::StatusCode::UNAVAILABLE ? PoisonWatch::End::kWorkerDied
                                                              : PoisonWatch::End::kUnknown;
}

grpc::Status PoisonStatus() {
  return ToGrpcStatus(
      ServiceError(ErrorReason::kPictureKillsWorker,
                   "the inference worker died while this was its only picture: see "
                   "the server's log; send the picture smaller or in another format"));
}

}  // namespace

InferenceClient::InferenceClient(InferenceLink link) : link_(std::move(link)) {
  if (link_.target.empty()) return;
  stub_ = internal::v1::InferenceService::NewStub(MakeChannel(link_.target));
}

void InferenceClient::WarmUp() const {
  if (available() && link_.demand) link_.demand();
}

void InferenceClient::Start(const std::shared_ptr<Call>& call,
                            system_clock::time_point deadline,
                            std::function<void(const grpc::Status&)> done) {
  WarmUp();
  Order order{call, deadline, std::move(done), {}};
  bool is_poison = false;
  {
    const MutexLock lock(mutex_);
    // Digests are computed only after a worker has died; before there is nothing to compare with.
    if (!watch_.IsEmpty()) order.picture = DigestOfMessage(call->request);
    is_poison = watch_.IsPoison(order.picture);
    if (!is_poison) waiting_.push_back(order);
  }
  is_poison ? order.done(PoisonStatus()) : Pump();
}

void InferenceClient::Pump() {
  std::vector<Order> sent;
  {
    const MutexLock lock(mutex_);
    // In order of arrival: a suspect delays those behind it until it has been sent.
    while (!waiting_.empty() && watch_.MaySend(waiting_.front().picture)) {
      watch_.OnSent(waiting_.front().picture);
      sent.push_back(std::move(waiting_.front()));
      waiting_.pop_front();
    }
  }
  for (const Order& order : sent) Send(order);
}

void InferenceClient::Send(const Order& order) {
  const system_clock::time_point limit = system_clock::now() + link_.limit;
  const bool our_limit = limit < order.deadline;
  Call& call = *order.call;
  call.context.set_deadline(std::min(limit, order.deadline));
  call.context.set_wait_for_ready(true);
  std::shared_ptr<Stub> stub;
  {
    const MutexLock lock(mutex_);
    stub = stub_;
  }
  stub->async()->ColorizeImage(&call.context,
                               &call.request,
                               &call.response,
                               [this, order, stub, our_limit](const grpc::Status& status) {
                                 OnEnd(order, stub, status);
                                 Pump();
                                 // Must come last: this object may be destroyed afterwards.
                                 order.done(ExplainStatus(status, our_limit));
                               });
}

void InferenceClient::OnEnd(const Order& order,
                            const std::shared_ptr<Stub>& stub,
                            const grpc::Status& status) {
  const PoisonWatch::End end = ClassifyEnd(status);
  const bool died = end == PoisonWatch::End::kWorkerDied;
  const LivePicture picture = died ? DigestOfMessage(order.call->request) : order.picture;
  const MutexLock lock(mutex_);
  watch_.OnEnd(picture, end);
  // A new connection, so that the next picture does not fail with the dead worker's one and is not
  // mistaken for its cause.
  if (died && stub == stub_) {
    stub_ = internal::v1::InferenceService::NewStub(MakeChannel(link_.target));
  }
}

}  // namespace color3d
