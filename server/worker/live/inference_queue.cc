#include "server/worker/live/inference_queue.h"

#include <spdlog/spdlog.h>

#include <exception>
#include <utility>

#include "core/base/memory.h"
#include "server/base/service_error.h"
#include "server/rpc/calls/error_mapping.h"

namespace color3d {
namespace {

grpc::Status EndingStatus() {
  return ToGrpcStatus(ServiceError(ErrorReason::kInferenceLost,
                                   "the inference worker is ending; send the picture again"));
}

// Error of exhausted memory with the limit and the remedy.
void RethrowNamingMemory(const std::exception_ptr& error) {
  if (!error) return;
  try {
    std::rethrow_exception(error);
  } catch (const ServiceError&) {
    throw;
  } catch (const std::exception& e) {
    const auto* ours = dynamic_cast<const Error*>(&e);
    if ((ours != nullptr && ours->code() != ErrorCode::kInternal) || !IsOutOfMemory(e)) throw;
    throw ServiceError(ErrorReason::kOutOfMemory,
                       "the picture takes more memory than there is; send a smaller one, or {}",
                       MemoryRemedy());
  }
}

}  // namespace

InferenceQueue::InferenceQueue(LiveEngine& engine, int max_batch, size_t max_waiting)
    : engine_(engine), max_batch_(static_cast<size_t>(max_batch)), max_waiting_(max_waiting) {
  thread_ = std::thread([this] { Loop(); });
}

InferenceQueue::~InferenceQueue() {
  std::deque<Waiting> left;
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    left.swap(waiting_);
  }
  wake_.NotifyAll();
  for (const Waiting& call : left) call.reactor->Finish(EndingStatus());
  thread_.join();
}

grpc::ServerUnaryReactor* InferenceQueue::ColorizeImage(
    grpc::CallbackServerContext* context,
    const internal::v1::ColorizeImageRequest* request,
    internal::v1::ColorizeImageResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  bool taken = false;
  {
    const MutexLock lock(mutex_);
    if (!stopping_ && waiting_.size() < max_waiting_) {
      waiting_.push_back({context, reactor, {request, response, nullptr}});
      taken = true;
    }
  }
  if (taken) {
    wake_.NotifyAll();
  } else {
    reactor->Finish(OverloadedStatus());
  }
  return reactor;
}

InferenceQueue::State InferenceQueue::state() const {
  const MutexLock lock(mutex_);
  const auto now = SteadyClock::now();
  State state;
  state.idle = !busy_ && waiting_.empty();
  state.since = now - changed_;
  if (busy_) state.batch = now - batch_start_;
  state.pictures = pictures_;
  return state;
}

std::vector<InferenceQueue::Waiting> InferenceQueue::Take() {
  std::vector<Waiting> batch;
  std::vector<Waiting> cancelled;
  {
    const MutexLock lock(mutex_);
    busy_ = false;
    changed_ = SteadyClock::now();
    while (!stopping_ && waiting_.empty()) wake_.Wait(mutex_);
    busy_ = true;
    changed_ = batch_start_ = SteadyClock::now();
    while (!waiting_.empty() && batch.size() < max_batch_) {
      Waiting call = std::move(waiting_.front());
      waiting_.pop_front();
      (call.context->IsCancelled() ? cancelled : batch).push_back(std::move(call));
    }
    pictures_ += static_cast<int64_t>(batch.size());
  }
  for (const Waiting& call : cancelled) call.reactor->Finish(grpc::Status::CANCELLED);
  return batch;
}

void InferenceQueue::Answer(std::vector<Waiting> batch) {
  std::vector<LiveTask> tasks;
  for (const Waiting& call : batch) {
    call.task.response->set_batch_size(static_cast<int>(batch.size()));
    tasks.push_back(call.task);
  }
  try {
    engine_.Colorize(tasks);
  } catch (const std::exception&) {
    for (LiveTask& task : tasks) task.error = std::current_exception();
  }
  for (size_t i = 0; i < batch.size(); ++i) {
    batch[i].reactor->Finish(Guard([&] { RethrowNamingMemory(tasks[i].error); }));
  }
}

void InferenceQueue::Loop() {
  const grpc::Status warm = Guard([this] { engine_.WarmUp(); });
  if (!warm.ok()) spdlog::error("the inference worker cannot load: {}", warm.error_message());
  while (true) {
    std::vector<Waiting> batch = Take();
    if (!batch.empty()) {
      Answer(std::move(batch));
      continue;
    }
    const MutexLock lock(mutex_);
    if (stopping_) return;
  }
}

}  // namespace color3d
