#include "server/rpc/jobs/job_log_stream.h"

#include <grpcpp/alarm.h>

#include <atomic>
#include <fstream>
#include <memory>
#include <optional>

#include "server/ops/job_log.h"
#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {

constexpr size_t kChunkBytes = 64 << 10;
constexpr std::chrono::milliseconds kPause{500};

// One step at a time, each on the executor or after a pause; the step that has nothing more to do
// finishes. A step holds a reference: what it sets off may finish the stream while it still runs.
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
    // A fresh one: the last one's callback may not have returned yet.
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
    // Asked first: what a finished job wrote is all there.
    const bool finished = IsFinished(store_->GetJob(request_.name()).state);
    std::ifstream file(JobLogFile(parts_.job_logs, request_.name()), std::ios::binary);
    std::string* data = chunk_.mutable_data();
    data->resize(kChunkBytes);
    file.seekg(offset_);
    file.read(data->data(), static_cast<std::streamsize>(data->size()));
    data->resize(static_cast<size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    data->resize(data->rfind('\n') + 1);  // whole lines; none: empty
    if (data->empty()) return finished || !request_.follow() ? Next::kEnd : Next::kPause;
    chunk_.set_offset(offset_);
    offset_ += static_cast<int64_t>(data->size());
    return Next::kWrite;
  }

  const RpcParts& parts_;
  const grpc::CallbackServerContext& context_;
  const v1::ReadJobLogRequest request_;
  std::shared_ptr<JobLogStream> self_;
  std::optional<ProjectStore> store_;  // since the first step
  StreamLimit::Place place_;
  int64_t offset_;
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
