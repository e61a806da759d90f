#include "server/backends/grpc_colorizer.h"

#include <fmt/core.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cmath>

#include "color3d/backend/v1/backend.grpc.pb.h"
#include "server/backends/backend_call.h"
#include "server/backends/backend_info.h"

namespace color3d {
namespace {

using backend::v1::ColorBackend;
using std::chrono::milliseconds;

constexpr int64_t kProgressSteps = 1000;
constexpr size_t kMaxTextBytes = 200;

// Text of a backend, made safe for a line of the log.
std::string PrintableText(const std::string& text) {
  std::string plain = text.substr(0, kMaxTextBytes);
  std::replace_if(
      plain.begin(), plain.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
  return plain;
}

const char* CapabilityName(int value) {
  switch (value) {
    case backend::v1::CAPABILITY_AUTOMATIC:
      return capability::kAutomatic;
    case backend::v1::CAPABILITY_TEXT_PROMPT:
      return capability::kTextPrompt;
    case backend::v1::CAPABILITY_REFERENCE_IMAGE:
      return capability::kReferenceImage;
    case backend::v1::CAPABILITY_COLOR_POINTS:
      return capability::kColorPoints;
    case backend::v1::CAPABILITY_MASK:
      return capability::kMask;
    case backend::v1::CAPABILITY_SEED:
      return capability::kSeed;
    case backend::v1::CAPABILITY_OUTPAINT:
      return capability::kOutpaint;
    case backend::v1::CAPABILITY_ANIMATE:
      return capability::kAnimate;
    case backend::v1::CAPABILITY_NOVEL_VIEW:
      return capability::kNovelView;
    default:
      return nullptr;
  }
}

backend::v1::ColorizeRequest ToProto(const RemoteRequest& request) {
  backend::v1::ColorizeRequest proto;
  proto.set_idempotency_key(request.idempotency_key);
  proto.set_image(request.image_png);
  proto.set_prompt(request.prompt);
  proto.set_reference_image(request.reference_image);
  for (const RemotePoint& point : request.points) {
    backend::v1::ColorPoint* entry = proto.add_points();
    entry->set_x(point.x_px);
    entry->set_y(point.y_px);
    entry->set_color(point.color);
  }
  proto.set_mask(request.mask_png);
  proto.set_seed(request.seed);
  return proto;
}

backend::v1::Capability KindFromName(const std::string& name) {
  for (const backend::v1::Capability kind : {backend::v1::CAPABILITY_OUTPAINT,
                                             backend::v1::CAPABILITY_ANIMATE,
                                             backend::v1::CAPABILITY_NOVEL_VIEW}) {
    if (name == CapabilityName(kind)) return kind;
  }
  throw InvalidArgument("no backend generates pictures of kind '{}'", name);
}

class GrpcColorizer : public RemoteColorizer {
 public:
  GrpcColorizer(const std::string& name,
                const std::string& address,
                const GrpcColorizerOptions& options)
      : name_(name),
        address_(ParseBackendAddress(name, address)),
        options_(options),
        stub_(ColorBackend::NewStub(OpenBackend(address_, options.max_message_bytes))) {}

  RemoteInfo GetInfo(ProgressObserver& progress, const CancellationToken& cancel) override;
  std::string Colorize(const RemoteRequest& request,
                       ProgressObserver& progress,
                       const CancellationToken& cancel) override;
  std::vector<std::string> Generate(const RemoteGenerateRequest& request,
                                    ProgressObserver& progress,
                                    const CancellationToken& cancel) override;

 private:
  // Repeats `call` while the backend is unavailable. Throws the error of its last status.
  void Retry(milliseconds deadline,
             const CancellationToken& cancel,
             const std::function<grpc::Status(grpc::ClientContext*)>& call);
  grpc::Status ColorizeOnce(const backend::v1::ColorizeRequest& request,
                            grpc::ClientContext* context,
                            ProgressObserver& progress,
                            std::string* image);
  grpc::Status GenerateOnce(const backend::v1::GenerateRequest& request,
                            grpc::ClientContext* context,
                            ProgressObserver& progress,
                            std::vector<std::string>* images);
  void ReportShare(double share, int64_t* step, ProgressObserver& progress) const;
  void RequireSendable(const google::protobuf::Message& request) const;
  [[noreturn]] void BadStream(const std::string& why) const {
    throw Error(ErrorCode::kFailedPrecondition, "the backend '{}' {}", name_, why);
  }

  const std::string name_;
  const BackendAddress address_;
  const GrpcColorizerOptions options_;
  const std::unique_ptr<ColorBackend::Stub> stub_;
};

void GrpcColorizer::Retry(milliseconds deadline,
                          const CancellationToken& cancel,
                          const std::function<grpc::Status(grpc::ClientContext*)>& call) {
  milliseconds backoff = options_.first_backoff;
  for (int tries_left = options_.tries - 1;; --tries_left) {
    cancel.ThrowIfCancelled();
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + deadline);
    if (!options_.traceparent.empty()) context.AddMetadata("traceparent", options_.traceparent);
    grpc::Status status;
    {
      const CancelWatch watch(context, cancel);
      status = call(&context);
    }
    if (status.ok()) return;
    cancel.ThrowIfCancelled();
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE || tries_left <= 0) {
      throw BackendError(name_, address_.target, status);
    }
    SleepUnlessCancelled(backoff, cancel);
    backoff *= 2;
  }
}

RemoteInfo GrpcColorizer::GetInfo(ProgressObserver& progress, const CancellationToken& cancel) {
  const auto end = std::chrono::steady_clock::now() + options_.ready_patience;
  backend::v1::BackendInfo info;
  for (;;) {
    Retry(options_.info_deadline, cancel, [&](grpc::ClientContext* context) {
      info.Clear();
      return stub_->GetInfo(context, backend::v1::GetInfoRequest(), &info);
    });
    if (info.ready()) return InfoFromProto(info);
    if (std::chrono::steady_clock::now() >= end) {
      throw Error(ErrorCode::kUnavailable,
                  "the backend '{}' ({}) is still loading its model; retry the job when it is "
                  "ready (`color3d server info` tells)",
                  name_,
                  address_.target);
    }
    progress.OnProgress(0, 0, "waiting for the backend " + name_ + " to load its model");
    SleepUnlessCancelled(options_.ready_poll, cancel);
  }
}

void GrpcColorizer::ReportShare(double share, int64_t* step, ProgressObserver& progress) const {
  if (!std::isfinite(share)) return;
  // Never decreases.
  *step = std::max<int64_t>(*step, std::llround(std::clamp(share, 0.0, 1.0) * kProgressSteps));
  progress.OnProgress(*step, kProgressSteps, "backend " + name_);
}

void GrpcColorizer::RequireSendable(const google::protobuf::Message& request) const {
  if (request.ByteSizeLong() <= static_cast<size_t>(options_.max_message_bytes)) return;
  throw InvalidArgument(
      "the photo and its references take {} bytes; at most {} are sent to a backend: use "
      "smaller photos",
      request.ByteSizeLong(),
      options_.max_message_bytes);
}

grpc::Status GrpcColorizer::ColorizeOnce(const backend::v1::ColorizeRequest& request,
                                         grpc::ClientContext* context,
                                         ProgressObserver& progress,
                                         std::string* image) {
  image->clear();
  const auto reader = stub_->Colorize(context, request);
  backend::v1::ColorizeUpdate update;
  int64_t step = 0;
  std::string fault;
  while (fault.empty() && reader->Read(&update)) {
    if (!image->empty()) {
      fault = "sent more data after its picture";
    } else if (update.has_image()) {
      *image = std::move(*update.mutable_image());
      if (image->empty()) fault = "answered with an empty picture";
    } else {
      ReportShare(update.progress(), &step, progress);
    }
  }
  if (!fault.empty()) context->TryCancel();
  const grpc::Status status = reader->Finish();
  if (!fault.empty()) BadStream(fault);
  return status;
}

std::string GrpcColorizer::Colorize(const RemoteRequest& request,
                                    ProgressObserver& progress,
                                    const CancellationToken& cancel) {
  const backend::v1::ColorizeRequest proto = ToProto(request);
  RequireSendable(proto);
  std::string image;
  Retry(options_.deadline, cancel, [&](grpc::ClientContext* context) {
    return ColorizeOnce(proto, context, progress, &image);
  });
  if (image.empty()) BadStream("ended without a picture");
  return image;
}

grpc::Status GrpcColorizer::GenerateOnce(const backend::v1::GenerateRequest& request,
                                         grpc::ClientContext* context,
                                         ProgressObserver& progress,
                                         std::vector<std::string>* images) {
  images->clear();
  const auto reader = stub_->Generate(context, request);
  backend::v1::GenerateUpdate update;
  int64_t step = 0;
  size_t bytes = 0;
  std::string fault;
  while (fault.empty() && reader->Read(&update)) {
    if (!update.has_image()) {
      ReportShare(update.progress(), &step, progress);
      continue;
    }
    bytes += update.image().size();
    if (update.image().empty()) {
      fault = "answered with an empty picture";
    } else if (images->size() >= static_cast<size_t>(request.samples())) {
      fault = fmt::format("sent more pictures than the {} asked for", request.samples());
    } else if (bytes > static_cast<size_t>(options_.max_message_bytes)) {
      fault = fmt::format("sent more than {} bytes of pictures", options_.max_message_bytes);
    } else {
      images->push_back(std::move(*update.mutable_image()));
    }
  }
  if (!fault.empty()) context->TryCancel();
  const grpc::Status status = reader->Finish();
  if (!fault.empty()) BadStream(fault);
  return status;
}

std::vector<std::string> GrpcColorizer::Generate(const RemoteGenerateRequest& request,
                                                 ProgressObserver& progress,
                                                 const CancellationToken& cancel) {
  backend::v1::GenerateRequest proto;
  proto.set_idempotency_key(request.idempotency_key);
  proto.set_image(request.image_png);
  proto.set_kind(KindFromName(request.kind));
  proto.set_samples(request.samples);
  proto.set_seed(request.seed);
  RequireSendable(proto);
  std::vector<std::string> images;
  Retry(options_.deadline, cancel, [&](grpc::ClientContext* context) {
    return GenerateOnce(proto, context, progress, &images);
  });
  if (images.empty()) BadStream("ended without a picture");
  return images;
}

}  // namespace

RemoteInfo InfoFromProto(const backend::v1::BackendInfo& info) {
  RemoteInfo result;
  result.description = PrintableText(info.name()) + (info.version().empty() ? "" : " ") +
                       PrintableText(info.version()) +
                       (info.license().empty() ? "" : " (" + PrintableText(info.license()) + ")");
  for (const int value : info.capabilities()) {
    if (const char* name = CapabilityName(value)) result.capabilities.insert(name);
  }
  result.max_pixels = info.max_pixels();
  result.deterministic = info.deterministic();
  return result;
}

std::unique_ptr<RemoteColorizer> MakeGrpcColorizer(const std::string& name,
                                                   const std::string& address,
                                                   const GrpcColorizerOptions& options) {
  return std::make_unique<GrpcColorizer>(name, address, options);
}

std::unique_ptr<RemoteColorizer> MakeGrpcColorizer(
    const std::map<std::string, std::string>& backends,
    const std::string& name,
    const GrpcColorizerOptions& options) {
  const auto found = backends.find(name);
  if (found != backends.end()) return MakeGrpcColorizer(name, found->second, options);
  std::string known;
  for (const auto& [other, address] : backends) known += (known.empty() ? "" : ", ") + other;
  throw Error(ErrorCode::kFailedPrecondition,
              "this server has no backend '{}' (it has: {}); start it with --backend {}=ADDRESS "
              "and retry the job",
              name,
              known.empty() ? "none" : known,
              name);
}

}  // namespace color3d
