#include "server/rpc/live/colorize_hub.h"

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "server/base/service_error.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/live/colorize_request.h"

namespace color3d {

// One stream. The next operation is decided under the mutex and started outside of it, because gRPC
// may call back on the same thread. `reading_`, `starting_read_`, `writing_` and `finished_` mark
// decided operations.
class ColorizeStream final
    : public grpc::ServerBidiReactor<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse>,
      public std::enable_shared_from_this<ColorizeStream> {
 public:
  ColorizeStream(ColorizeHub& hub,
                 grpc::CallbackServerContext* context,
                 ProjectStore store,
                 StreamLimit::Place place)
      : hub_(hub),
        parts_(hub.parts_),
        store_(std::move(store)),
        place_(std::move(place)),
        deadline_(context->deadline()) {}

  // Reads no more pictures, answers the pending ones, then ends with `status`.
  void End(const grpc::Status& status) {
    {
      const MutexLock lock(mutex_);
      if (!end_) end_ = status;
    }
    Pump();
  }

  // Must be called before the first Pump.
  void WatchSilence() {
    silence_.emplace(
        parts_.silence,
        [stream = weak_from_this(), limit = hub_.limits_.silence] {
          if (const auto self = stream.lock()) self->End(SilentStatus(limit));
        },
        hub_.limits_.silence);
  }

  void Pump() {
    const auto self = shared_from_this();
    while (true) {
      switch (Decide()) {
        case Step::kNothing:
          return UpdateSilence();
        case Step::kRead: {
          StartRead(&incoming_);
          const MutexLock lock(mutex_);
          starting_read_ = false;
          break;
        }
        case Step::kWrite:
          StartWrite(&outgoing_);
          break;
        case Step::kFinish:
          return Finish(last_status_);
      }
    }
  }

  void OnReadDone(bool ok) override {
    std::shared_ptr<Picture> picture;
    {
      const MutexLock lock(mutex_);
      reading_ = false;
      if (!ok) {
        if (!end_) end_ = grpc::Status::OK;  // the client has sent all pictures
      } else if (!end_) {
        picture = std::make_shared<Picture>();
        picture->hold = hub_.client_.Hold();
        picture->request.Swap(&incoming_);
        pictures_.insert(picture);
        ++hub_.pictures_;
      }
    }
    if (picture) {
      parts_.slow.Post([self = shared_from_this(), picture] { self->Forward(picture); });
    }
    Pump();
  }

  void OnWriteDone(bool ok) override {
    {
      const MutexLock lock(mutex_);
      writing_ = false;
      --hub_.pictures_;
    }
    ok ? Pump() : Abandon();
  }
  void OnCancel() override { Abandon(); }
  void OnDone() override { hub_.Unregister(this); }

 private:
  enum class Step { kNothing, kRead, kWrite, kFinish };
  struct Picture {
    std::shared_ptr<void> hold;  // keeps the worker running until the picture is answered
    v1::ColorizeImagesRequest request;
    v1::ColorizeImagesResponse response;
    std::shared_ptr<InferenceClient::Call> call = std::make_shared<InferenceClient::Call>();
  };

  Step Decide() {
    const MutexLock lock(mutex_);
    if (finished_) return Step::kNothing;
    if (!writing_ && !replies_.empty()) {
      outgoing_ = std::move(replies_.front());
      replies_.pop_front();
      writing_ = true;
      return Step::kWrite;
    }
    if (end_ && !writing_ && !starting_read_ && pictures_.empty()) {
      finished_ = true;
      last_status_ = *end_;
      return Step::kFinish;
    }
    const size_t held = pictures_.size() + replies_.size() + (writing_ ? 1 : 0);
    const bool room = held == 0 || (held < static_cast<size_t>(hub_.limits_.window) &&
                                    hub_.pictures_.load() < hub_.limits_.max_pictures);
    if (end_ || reading_ || !room) return Step::kNothing;
    reading_ = true;
    starting_read_ = true;
    return Step::kRead;
  }

  static grpc::Status SilentStatus(std::chrono::milliseconds limit) {
    return ToGrpcStatus(
        ServiceError(ErrorReason::kStreamSilent,
                     "the stream was idle for {} s; open another one for the next picture",
                     limit.count() / 1000));
  }

  // Silence counts only while no picture is pending.
  void UpdateSilence() {
    const MutexLock lock(mutex_);
    const bool waits = reading_ && !writing_ && !end_ && pictures_.empty() && replies_.empty();
    if (waits == waits_for_client_) return;
    waits_for_client_ = waits;
    if (waits) {
      silence_->Wait();
    } else {
      silence_->Resume();
    }
  }

  // Runs on the executor.
  void Forward(const std::shared_ptr<Picture>& picture) {
    const grpc::Status status = Guard([&] {
      ResolveColorizeRequest(
          parts_, store_, &picture->request, &picture->call->request, &picture->response);
    });
    if (!status.ok()) return Answer(picture, status);
    hub_.client_.Start(
        picture->call, deadline_, [self = shared_from_this(), picture](const grpc::Status& end) {
          self->Answer(picture, end);
        });
  }

  void Answer(const std::shared_ptr<Picture>& picture, const grpc::Status& answered) {
    v1::ColorizeImagesResponse& response = picture->response;
    const grpc::Status status = answered.ok() ? FillResponse(picture) : answered;
    response.set_request_id(picture->request.request_id().substr(0, 128));
    if (status.ok()) {
      response.clear_error();
    } else if (!response.mutable_error()->ParseFromString(status.error_details()) ||
               response.error().code() == 0) {
      response.mutable_error()->set_code(status.error_code());
      response.mutable_error()->set_message(status.error_message());
    }
    {
      const MutexLock lock(mutex_);
      pictures_.erase(picture);
      if (abandoned_) {
        --hub_.pictures_;
      } else {
        replies_.push_back(std::move(response));
      }
    }
    Pump();
  }

  // An answer that is too large for a message is stored as a blob of the project.
  grpc::Status FillResponse(const std::shared_ptr<Picture>& picture) {
    v1::ColorizeImagesResponse& response = picture->response;
    internal::v1::ColorizeImageResponse& answer = picture->call->response;
    response.mutable_image()->swap(*answer.mutable_image());
    response.set_encoder_digest(answer.encoder_digest());
    response.set_batch_size(answer.batch_size());
    if (answer.image_sha256().empty()) return grpc::Status::OK;
    const FileDigest blob{answer.image_sha256(), answer.image_size_bytes()};
    *response.mutable_image_digest() = ToProto(blob);
    return Guard([&] {
      RequireQuota(parts_, store_, blob.size_bytes);
      store_.HoldBlob(blob);
    });
  }

  // The client is gone: cancels pending pictures and drops finished ones.
  void Abandon() {
    std::vector<std::shared_ptr<Picture>> under_way;
    {
      const MutexLock lock(mutex_);
      abandoned_ = true;
      end_ = grpc::Status::CANCELLED;
      hub_.pictures_ -= static_cast<int>(replies_.size());
      replies_.clear();
      under_way.assign(pictures_.begin(), pictures_.end());
    }
    for (const auto& picture : under_way) picture->call->context.TryCancel();
    Pump();
  }

  ColorizeHub& hub_;
  const RpcParts& parts_;
  const ProjectStore store_;
  const StreamLimit::Place place_;
  const std::chrono::system_clock::time_point deadline_;
  v1::ColorizeImagesRequest incoming_;
  v1::ColorizeImagesResponse outgoing_;

  Mutex mutex_;
  bool reading_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool starting_read_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool writing_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool abandoned_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool finished_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool waits_for_client_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::optional<SilenceWatch::Stream> silence_;
  grpc::Status last_status_;  // set once, together with finished_
  std::optional<grpc::Status> end_
      COLOR3D_GUARDED_BY(mutex_);  // how the stream will end; set: no more pictures are read
  std::set<std::shared_ptr<Picture>> pictures_ COLOR3D_GUARDED_BY(mutex_);  // pending pictures
  std::deque<v1::ColorizeImagesResponse> replies_ COLOR3D_GUARDED_BY(mutex_);
};

namespace {

// A stream that is refused at once.
class RefusedStream final
    : public grpc::ServerBidiReactor<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse> {
 public:
  explicit RefusedStream(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

grpc::Status NoWorkerStatus() {
  return ToGrpcStatus(ServiceError(ErrorReason::kNoInferenceWorker,
                                   "this server has no inference worker: install color3d-worker "
                                   "beside color3d-server and restart it"));
}

}  // namespace

ColorizeHub::ColorizeHub(const RpcParts& parts, InferenceLink link, ColorizeLimits limits)
    : parts_(parts), client_(std::move(link)), limits_(limits) {}

grpc::ServerBidiReactor<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse>* ColorizeHub::Open(
    grpc::CallbackServerContext* context) {
  std::optional<Call> call;
  StreamLimit::Place place;
  const grpc::Status allowed = Guard([&] {
    call = Admit(parts_, Role::kSubmit, *context);
    place = parts_.streams.live.Take(call->caller.project);
  });
  if (!allowed.ok()) return new RefusedStream(allowed);
  if (!client_.available()) return new RefusedStream(NoWorkerStatus());
  client_.WarmUp();
  const auto stream =
      std::make_shared<ColorizeStream>(*this, context, call->store, std::move(place));
  stream->WatchSilence();
  {
    const MutexLock lock(mutex_);
    if (draining_) return new RefusedStream(DrainingStatus());
    streams_.insert(stream);
  }
  stream->Pump();
  return stream.get();
}

void ColorizeHub::Drain() {
  std::set<std::shared_ptr<ColorizeStream>> streams;
  {
    const MutexLock lock(mutex_);
    draining_ = true;
    streams = streams_;
  }
  for (const auto& stream : streams) stream->End(DrainingStatus());
}

void ColorizeHub::Unregister(ColorizeStream* stream) {
  const MutexLock lock(mutex_);
  streams_.erase(stream->shared_from_this());
}

}  // namespace color3d
