#include "server/rpc/jobs/job_log_stream.h"

#include <grpcpp/alarm.h>

#include <atomic>
#include <memory>
#include <optional>

#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {

constexpr size_t kChunkBytes = 64 << 10;
constexpr std::chrono::milliseconds kPause{500};
constexpr int kPausesAtEnd = 3;

// Runs one step at a time, each on the executor or after a pause; the last step finishes. A step
// holds a reference, because what it starts may finish the stream while the step still runs.
class JobLogStream final : public grpc::ServerWriteReactor<v1::JobLogChunk> {
 public:
  JobLogStream(const RpcParts& parts,
               const grpc::CallbackServerContext& context,
               const v1::ReadJobLogRequest& request)
      : parts_(parts), context_(context), request_(request), offset_(request.offset()) {}
  // Keeps itself alive until OnDone.
  void Start(const std::shared_ptr<JobLogStream>& self) {
    self_ = self;
    PostStep();
  }
  void OnWriteDone(bool ok) override { ok ? PostStep() : Finish(grpc::Status::CANCELLED); }
  void OnCancel() override { cancelled_ = true; }  // seen after the pause
  void OnDone() override { self_.reset(); }

 private:
  enum class Next { kWrite, kPause, kEnd };

  void PostStep() {
    parts_.quick.Post([self = self_] { self->Step(); });
  }

  void Step() {
    Next next = Next::kEnd;
    const grpc::Status status = Guard([&] { next = Read(); });
    if (!status.ok() || next == Next::kEnd) return Finish(status);
    if (next == Next::kWrite) return StartWrite(&chunk_);
    if (parts_.draining) return Finish(DrainingStatus());
    if (cancelled_) return Finish(grpc::Status::CANCELLED);
    // A new alarm: the callback of the last one may not have returned yet.
    alarm_ = std::make_unique<grpc::Alarm>();
    alarm_->Set(std::chrono::system_clock::now() + kPause,
                [this](bool) { cancelled_ ? Finish(grpc::Status::CANCELLED) : PostStep(); });
  }

  Next Read() {
    if (!store_) {
      store_ = Admit(parts_, Role::kRead, context_).store;
      CheckName(request_.name(), "jobs");
      if (offset_ < 0) throw InvalidArgument("offset is {}; it must not be negative", offset_);
      place_ = parts_.streams.watches.Take(store_->project());
    }
    // Read before the log.
    const bool finished = IsFinished(store_->GetJob(request_.name()).state);
    std::string* data = chunk_.mutable_data();
    data->clear();
    if (parts_.job_logs) *data = parts_.job_logs->Read(request_.name(), offset_, kChunkBytes);
    data->resize(data->rfind('\n') + 1);  // whole lines only
    // Workers send their last lines within a second of the job's end.
    if (data->empty() && request_.follow() && finished && ++pauses_at_end_ <= kPausesAtEnd) {
      return Next::kPause;
    }
    if (data->empty()) return finished || !request_.follow() ? Next::kEnd : Next::kPause;
    chunk_.set_offset(offset_);
    offset_ += static_cast<int64_t>(data->size());
    return Next::kWrite;
  }

  const RpcParts& parts_;
  const grpc::CallbackServerContext& context_;
  const v1::ReadJobLogRequest request_;
  std::shared_ptr<JobLogStream> self_;
  std::optional<ProjectStore> store_;  // set by the first step
  StreamLimit::Place place_;
  int64_t offset_;
  int pauses_at_end_ = 0;
  v1::JobLogChunk chunk_;
  std::unique_ptr<grpc::Alarm> alarm_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace

grpc::ServerWriteReactor<v1::JobLogChunk>* StreamJobLog(const RpcParts& parts,
                                                        const grpc::CallbackServerContext& context,
                                                        const v1::ReadJobLogRequest& request) {
  const auto stream = std::make_shared<JobLogStream>(parts, context, request);
  stream->Start(stream);
  return stream.get();
}

}  // namespace color3d
