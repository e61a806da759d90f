#include "server/rpc/calls/call_watch.h"

#include <grpcpp/server_context.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <map>

#include "server/store/job.h"

namespace color3d {
namespace {
using grpc::experimental::InterceptionHookPoints;
using SteadyClock = std::chrono::steady_clock;

bool IsLowHex(std::string_view text) {
  return std::ranges::all_of(
      text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
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
            grpc::experimental::ServerRpcInfo* info)
      : observer_(observer), peers_(peers), info_(info), method_(info->method()) {}
  // Cancelled calls may end without a status of the service.
  ~CallWatch() override {
    if (!ended_) End(grpc::StatusCode::CANCELLED);
    if (!peer_.empty()) peers_.on_end(peer_);
  }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      TakeMetadata(*methods->GetRecvInitialMetadata());
      RecordPeer();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      methods->GetSendTrailingMetadata()->insert({"x-request-id", request_id_});
      End(methods->GetSendStatus().error_code());
    }
    methods->Proceed();
  }

 private:
  void TakeMetadata(const std::multimap<grpc::string_ref, grpc::string_ref>& metadata) {
    const auto find = [&](const char* name) {
      const auto entry = metadata.find(name);
      return entry == metadata.end() ? std::string()
                                     : std::string(entry->second.data(), entry->second.size());
    };
    request_id_ = ChooseRequestId(find("x-request-id"));
    trace_ = ParseTraceId(find("traceparent"));
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
  grpc::experimental::ServerRpcInfo* const info_;
  const std::string method_;
  std::string peer_;  // empty: on_begin was not called
  const SteadyClock::time_point start_ = SteadyClock::now();
  std::string request_id_, trace_;
  bool ended_ = false;
};

class CallWatchFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  CallWatchFactory(CallObserver observer, PeerObserver peers)
      : observer_(std::move(observer)), peers_(std::move(peers)) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* info) override {
    return new CallWatch(observer_, peers_, info);
  }

 private:
  const CallObserver observer_;
  const PeerObserver peers_;
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

std::string ParseTraceId(std::string_view traceparent) {
  // version "-" trace id "-" parent id "-" flags; later versions may append fields.
  if (traceparent.size() < 55 || traceparent[2] != '-' || traceparent[35] != '-' ||
      traceparent[52] != '-') {
    return "";
  }
  const std::string_view version = traceparent.substr(0, 2), trace = traceparent.substr(3, 32),
                         parent = traceparent.substr(36, 16), flags = traceparent.substr(53, 2);
  const auto is_zero = [](std::string_view id) {
    return id.find_first_not_of('0') == std::string_view::npos;
  };
  const bool is_whole = version == "00" ? traceparent.size() == 55
                                        : traceparent.size() == 55 || traceparent[55] == '-';
  if (!is_whole || version == "ff" || !IsLowHex(version) || !IsLowHex(trace) || !IsLowHex(parent) ||
      !IsLowHex(flags) || is_zero(trace) || is_zero(parent)) {
    return "";
  }
  return std::string(trace);
}

std::string ChooseRequestId(std::string_view header) {
  return IsValidRequestId(header) ? std::string(header) : NewId();
}

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallWatch(
    CallObserver observer, PeerObserver peers) {
  return std::make_unique<CallWatchFactory>(std::move(observer), std::move(peers));
}

}  // namespace color3d
