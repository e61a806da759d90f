#include "client/lib/live_coloring.h"

#include <set>
#include <thread>

#include "client/lib/blob_transfer.h"
#include "client/lib/scene_upload.h"
#include "core/base/files.h"
#include "core/base/mutex.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kMaxInlineBytes = 3 << 20;
// Time for a worker to start, and for the pictures of others in the queue.
constexpr auto kStreamLimit = std::chrono::minutes(30);

using Stream = grpc::ClientReaderWriter<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse>;
using OnAnswer = std::function<void(size_t, const v1::ColorizeImagesResponse&)>;

class LiveRound {
 public:
  LiveRound(Connection& connection, const LiveSource& source, const LiveOptions& options)
      : connection_(connection), source_(source), options_(options) {}

  // Sends those of `pictures` in `pending` in one stream; removes the ones that got a final answer.
  grpc::Status Run(const std::vector<LivePicture>& pictures,
                   std::set<size_t>* pending,
                   const OnAnswer& on_answer);

 private:
  v1::ColorizeImagesRequest RequestFor(const LivePicture& picture, size_t number);
  void CountAnswer(bool over) {
    const MutexLock lock(mutex_);
    over_ = over;
    --in_flight_;
    answered_.NotifyAll();
  }
  void Write(Stream& stream, const std::vector<LivePicture>& pictures, std::set<size_t> pending);

  Connection& connection_;
  const LiveSource& source_;
  const LiveOptions& options_;
  Mutex mutex_;
  CondVar answered_;
  int in_flight_ COLOR3D_GUARDED_BY(mutex_) = 0;
  bool over_ COLOR3D_GUARDED_BY(mutex_) = false;  // answers are no longer read
  std::exception_ptr write_error_;                // of the writer; read after it has ended
};

v1::ColorizeImagesRequest LiveRound::RequestFor(const LivePicture& picture, size_t number) {
  v1::ColorizeImagesRequest request;
  request.set_request_id(std::to_string(number));
  request.set_colorizer(source_.colorizer);
  request.set_scene(source_.scene);
  if (source_.example) *request.mutable_example() = *source_.example;
  request.set_points(source_.points);
  request.set_max_side_px(options_.max_side_px);
  if (picture.stored) {
    *request.mutable_image_digest() = *picture.stored;
  } else if (static_cast<int64_t>(fs::file_size(picture.file)) <= kMaxInlineBytes) {
    request.set_image(ReadFile(picture.file, kMaxInlineBytes));
  } else {
    const UploadFile upload{picture.file, DigestFile(picture.file)};
    UploadMissing(connection_, {upload}, [](int64_t, int64_t) {});
    *request.mutable_image_digest() = ToProto(upload.digest);
  }
  return request;
}

void LiveRound::Write(Stream& stream,
                      const std::vector<LivePicture>& pictures,
                      std::set<size_t> pending) {
  try {
    for (const size_t i : pending) {
      {
        MutexLock lock(mutex_);
        while (!over_ && options_.in_flight != 0 && in_flight_ >= options_.in_flight) {
          answered_.Wait(mutex_);
        }
        if (over_) break;
        ++in_flight_;
      }
      if (!stream.Write(RequestFor(pictures[i], i))) break;
    }
  } catch (const std::exception&) {
    write_error_ = std::current_exception();
  }
  stream.WritesDone();
}

grpc::Status LiveRound::Run(const std::vector<LivePicture>& pictures,
                            std::set<size_t>* pending,
                            const OnAnswer& on_answer) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kStreamLimit);
  const std::unique_ptr<Stream> stream = connection_.colorizers().ColorizeImages(&context);
  std::thread writer([&] { Write(*stream, pictures, *pending); });
  std::exception_ptr failed;
  v1::ColorizeImagesResponse answer;
  while (stream->Read(&answer)) {
    CountAnswer(/*over=*/false);
    try {
      connection_.cancel().ThrowIfCancelled();
      const size_t number = std::stoul(answer.request_id());
      const bool later = answer.error().code() == grpc::StatusCode::UNAVAILABLE;
      if (later || pending->count(number) == 0) continue;
      on_answer(number, answer);
      pending->erase(number);
    } catch (const std::exception&) {
      failed = std::current_exception();
      context.TryCancel();
      break;
    }
  }
  CountAnswer(/*over=*/true);
  while (failed && stream->Read(&answer)) continue;
  writer.join();
  const grpc::Status status = stream->Finish();
  if (failed) std::rethrow_exception(failed);
  if (write_error_) std::rethrow_exception(write_error_);
  return status;
}

}  // namespace

void WarmUpInference(Connection& connection) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
  const auto stream = connection.colorizers().ColorizeImages(&context);
  stream->WritesDone();
  v1::ColorizeImagesResponse none;
  while (stream->Read(&none)) continue;
  stream->Finish();
}

void ColorizeLive(Connection& connection,
                  const LiveSource& source,
                  const std::vector<LivePicture>& pictures,
                  const LiveOptions& options,
                  const OnAnswer& on_answer) {
  std::set<size_t> pending;
  for (size_t i = 0; i < pictures.size(); ++i) pending.insert(i);
  Backoff backoff = connection.NewBackoff();
  FullServerWait turned_away(connection);
  while (!pending.empty()) {
    const size_t before = pending.size();
    LiveRound round(connection, source, options);
    const grpc::Status status = round.Run(pictures, &pending, on_answer);
    if (pending.size() < before) backoff.Reset(), turned_away.Reset();
    if (!status.ok() && turned_away.Wait(RpcError(status))) {
      backoff.Reset();
      continue;
    }
    if (!status.ok() && !RpcError(status).IsTransient()) throw RpcError(status);
    if (pending.empty() || backoff.Wait(connection.cancel())) continue;
    if (!status.ok()) throw RpcError(status);
    throw Error(ErrorCode::kUnavailable,
                "the server's inference worker does not answer; see its log, then try again");
  }
}

}  // namespace color3d::client
