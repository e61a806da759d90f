#include "server/rpc/calls/call_watch.h"

#include <grpcpp/server_context.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <map>
#include <optional>
#include <utility>

#include "server/store/job.h"

namespace color3d {
namespace {
using grpc::experimental::InterceptionHookPoints;
using SteadyClock = std::chrono::steady_clock;

constexpr char kTraceparent[] = "traceparent";

// Not health checks, reflection and the polling of workers.
bool HasSpan(const std::string& method) {
  return !method.starts_with("/grpc.") && !method.starts_with("/color3d.internal.");
}

// Faults of the server; those of the caller are no errors of its span.
bool IsServerFault(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
    case grpc::StatusCode::UNIMPLEMENTED:
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DATA_LOSS:
      return true;
    default:
      return false;
  }
}

bool IsValidRequestId(std::string_view id) {
  return !id.empty() && id.size() <= 64 && std::ranges::all_of(id, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
}

class CallWatch final : public grpc::experimental::Interceptor {
 public:
  CallWatch(const CallObserver& observer,
            const PeerObserver& peers,
            Tracer* tracer,
            grpc::experimental::ServerRpcInfo* info)
      : observer_(observer), peers_(peers), tracer_(tracer), info_(info), method_(info->method()) {}
  // Cancelled calls may end without a status of the service.
  ~CallWatch() override {
    if (!ended_) End(grpc::StatusCode::CANCELLED);
    if (!peer_.empty()) peers_.on_end(peer_);
  }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      TakeMetadata(methods->GetRecvInitialMetadata());
      RecordPeer();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      methods->GetSendTrailingMetadata()->insert({"x-request-id", request_id_});
      End(methods->GetSendStatus().error_code());
    }
    methods->Proceed();
  }

 private:
  void TakeMetadata(std::multimap<grpc::string_ref, grpc::string_ref>* metadata) {
    const auto find = [&](const char* name) {
      const auto entry = metadata->find(name);
      return entry == metadata->end() ? std::string()
                                      : std::string(entry->second.data(), entry->second.size());
    };
    request_id_ = ChooseRequestId(find("x-request-id"));
    const std::optional<TraceContext> parent = ParseTraceparent(find(kTraceparent));
    if (parent) trace_ = parent->trace_id;
    if (tracer_ != nullptr && HasSpan(method_)) BeginSpan(parent, metadata);
  }

  // What the call creates becomes part of its span.
  void BeginSpan(const std::optional<TraceContext>& parent,
                 std::multimap<grpc::string_ref, grpc::string_ref>* metadata) {
    span_.start_ns = UnixNanoseconds();
    span_.context = tracer_->Begin(parent);
    if (parent) span_.parent_id = parent->span_id;
    // A caller that records keeps its span as the parent of what is not recorded here.
    if (!span_.context.sampled) {
      if (!parent) return;
      span_.context.span_id = parent->span_id;
    }
    trace_ = span_.context.trace_id;
    traceparent_ = ToTraceparent(span_.context);
    metadata->erase(kTraceparent);
    metadata->emplace(kTraceparent, traceparent_);
  }

  void EndSpan(grpc::StatusCode code) {
    if (!span_.context.sampled) return;
    span_.end_ns = UnixNanoseconds();
    span_.kind = SpanKind::kServer;
    span_.name = method_.substr(1);
    const size_t slash = span_.name.find('/');
    span_.attributes = {{"rpc.system", "grpc"},
                        {"rpc.service", span_.name.substr(0, slash)},
                        {"rpc.method", span_.name.substr(slash + 1)},
                        {"rpc.grpc.status_code", static_cast<int64_t>(code)},
                        {"color3d.request", request_id_}};
    if (IsServerFault(code)) {
      span_.status = SpanStatus::kError;
      span_.status_message = StatusName(code);
    }
    tracer_->Record(std::move(span_));
  }

  void RecordPeer() {
    if (!peers_.on_begin || method_.starts_with("/grpc.")) return;
    peer_ = info_->server_context()->peer();
    if (!peer_.empty()) peers_.on_begin(peer_);
  }

  void End(grpc::StatusCode code) {
    ended_ = true;
    const double seconds = std::chrono::duration<double>(SteadyClock::now() - start_).count();
    if (observer_) observer_(method_, code, seconds);
    EndSpan(code);
    const bool is_ours = code == grpc::StatusCode::INTERNAL ||
                         code == grpc::StatusCode::DATA_LOSS || code == grpc::StatusCode::UNKNOWN;
    spdlog::log(is_ours ? spdlog::level::warn : spdlog::level::debug,
                "[request={}{}{}] {} {} after {:.1f} ms",
                request_id_,
                trace_.empty() ? "" : " trace=",
                trace_,
                method_,
                StatusName(code),
                seconds * 1000.0);
  }

  const CallObserver& observer_;
  const PeerObserver& peers_;
  Tracer* const tracer_;  // may be null
  grpc::experimental::ServerRpcInfo* const info_;
  const std::string method_;
  std::string peer_;  // empty: on_begin was not called
  const SteadyClock::time_point start_ = SteadyClock::now();
  std::string request_id_, trace_;
  std::string traceparent_;  // the metadata refer to it
  Span span_;
  bool ended_ = false;
};

class CallWatchFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  CallWatchFactory(CallObserver observer, PeerObserver peers, std::shared_ptr<Tracer> tracer)
      : observer_(std::move(observer)), peers_(std::move(peers)), tracer_(std::move(tracer)) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* info) override {
    return new CallWatch(observer_, peers_, tracer_.get(), info);
  }

 private:
  const CallObserver observer_;
  const PeerObserver peers_;
  const std::shared_ptr<Tracer> tracer_;
};

}  // namespace

const char* StatusName(grpc::StatusCode code) {
  static constexpr const char* kNames[] = {"OK",
                                           "CANCELLED",
                                           "UNKNOWN",
                                           "INVALID_ARGUMENT",
                                           "DEADLINE_EXCEEDED",
                                           "NOT_FOUND",
                                           "ALREADY_EXISTS",
                                           "PERMISSION_DENIED",
                                           "RESOURCE_EXHAUSTED",
                                           "FAILED_PRECONDITION",
                                           "ABORTED",
                                           "OUT_OF_RANGE",
                                           "UNIMPLEMENTED",
                                           "INTERNAL",
                                           "UNAVAILABLE",
                                           "DATA_LOSS",
                                           "UNAUTHENTICATED"};
  const auto index = static_cast<size_t>(code);
  return index < std::size(kNames) ? kNames[index] : "UNKNOWN";
}

std::string ChooseRequestId(std::string_view header) {
  return IsValidRequestId(header) ? std::string(header) : NewId();
}

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallWatch(
    CallObserver observer, PeerObserver peers, std::shared_ptr<Tracer> tracer) {
  return std::make_unique<CallWatchFactory>(
      std::move(observer), std::move(peers), std::move(tracer));
}

}  // namespace color3d
