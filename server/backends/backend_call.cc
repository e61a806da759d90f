#include "server/backends/backend_call.h"

#include <fmt/core.h>

#include <algorithm>

namespace color3d {
namespace {

constexpr std::chrono::milliseconds kLook{50};
constexpr size_t kMaxMessageBytes = 300;

// The backend's message as one line of plain text.
std::string Quoted(const std::string& message) {
  std::string text = message.substr(0, kMaxMessageBytes);
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c > 126; }, ' ');
  return text.empty() ? "no reason given" : "\"" + text + "\"";
}

}  // namespace

CancelWatch::CancelWatch(grpc::ClientContext& context, const CancellationToken& cancel) {
  thread_ = std::thread([this, &context, &cancel] {
    MutexLock lock(mutex_);
    while (!done_ && !cancel.IsCancelled()) wake_.WaitFor(mutex_, kLook);
    if (!done_) context.TryCancel();
  });
}

CancelWatch::~CancelWatch() {
  {
    const MutexLock lock(mutex_);
    done_ = true;
  }
  wake_.NotifyAll();
  thread_.join();
}

void SleepUnlessCancelled(std::chrono::milliseconds time, const CancellationToken& cancel) {
  const auto end = std::chrono::steady_clock::now() + time;
  for (;;) {
    cancel.ThrowIfCancelled();
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return;
    std::this_thread::sleep_for(std::min(left, kLook));
  }
}

Error BackendError(const std::string& name, const std::string& target, const grpc::Status& status) {
  const std::string who = fmt::format("the backend '{}' ({})", name, target);
  const std::string said = Quoted(status.error_message());
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return Error(ErrorCode::kUnavailable,
                   "{} cannot be reached: {}; start it, then retry the job",
                   who,
                   said);
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return Error(ErrorCode::kDeadlineExceeded,
                   "{} did not answer in time; retry with a smaller photo or a faster backend",
                   who);
    case grpc::StatusCode::CANCELLED:
      return Error(ErrorCode::kUnavailable, "{} aborted the call: {}; retry the job", who, said);
    case grpc::StatusCode::UNIMPLEMENTED:
      return Error(ErrorCode::kFailedPrecondition,
                   "{} does not speak color3d.backend.v1.ColorBackend: {}",
                   who,
                   said);
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return Error(ErrorCode::kFailedPrecondition,
                   "{} sent or received a message that is too large: {}",
                   who,
                   said);
    default:
      return Error(ErrorCode::kFailedPrecondition, "{} failed: {}", who, said);
  }
}

}  // namespace color3d
