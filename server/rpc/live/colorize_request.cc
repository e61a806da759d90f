#include "server/rpc/live/colorize_request.h"

#include "core/base/text/utf8.h"
#include "core/catalogue/stages.h"
#include "server/base/service_error.h"
#include "server/planning/job_spec.h"
#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {

constexpr size_t kMaxImageBytes = 3 << 20;
// Name of the colorizer that no job made.
constexpr char kAutomaticColorizer[] = "colorizers/automatic";
constexpr size_t kMaxPointsBytes = 1 << 20;
constexpr size_t kMaxRequestIdBytes = 128;
constexpr int kMinSidePx = 16;
constexpr int kMaxSidePx = 8192;

std::string RequireBlob(const RpcParts& parts,
                        const ProjectStore& store,
                        const v1::Digest& digest,
                        const std::string& field) {
  const FileDigest blob = FromProto(digest);
  if (!HasBlob(parts, store, blob)) {
    throw ServiceError(
        ErrorReason::kBlobMissing,
        "{} names the blob {}, which is not stored with {} bytes; upload it and try again",
        field,
        blob.sha256,
        blob.size_bytes);
  }
  return blob.sha256;
}

void TakePicture(const RpcParts& parts,
                 const ProjectStore& store,
                 v1::ColorizeImagesRequest* request,
                 internal::v1::ColorizeImageRequest* call) {
  if (request->image().empty() == !request->has_image_digest()) {
    throw InvalidArgument("set exactly one of image and image_digest");
  }
  if (request->image().size() > kMaxImageBytes) {
    throw ServiceError(ErrorReason::kImageTooLarge,
                       "image has {} bytes, at most 3 MiB are allowed; upload it as a blob and "
                       "send its image_digest",
                       request->image().size());
  }
  if (request->has_image_digest()) {
    call->set_image_sha256(RequireBlob(parts, store, request->image_digest(), "image_digest"));
  } else {
    call->mutable_image()->swap(*request->mutable_image());
  }
  const int side = request->max_side_px();
  if (side != 0 && (side < kMinSidePx || side > kMaxSidePx)) {
    throw InvalidArgument(
        "max_side_px is {}; the range is 16 to 8192, or 0 for the picture's own size", side);
  }
  call->set_max_side_px(side);
}

void TakeStrokes(const RpcParts& parts,
                 const ProjectStore& store,
                 v1::ColorizeImagesRequest* request,
                 internal::v1::ColorizeImageRequest* call) {
  if (request->points().size() > kMaxPointsBytes) {
    throw InvalidArgument("points has {} bytes; at most 1 MiB is allowed; merge strokes",
                          request->points().size());
  }
  call->mutable_points()->swap(*request->mutable_points());
  if (request->has_example()) {
    call->set_below_sha256(RequireBlob(parts, store, request->example(), "example"));
  }
}

ColorizerRecord NewestOf(const ProjectStore& store, const std::string& scene) {
  CheckName(scene, "scenes");
  const auto newest = store.ListColorizers(scene, 0, 1);
  if (!newest.empty()) return newest[0];
  store.GetScene(scene);  // throws if there is no such scene
  throw ServiceError(
      ErrorReason::kColorizerNotFound,
      "{} has no colorizer yet: run a {} or a {} job of it first, or send a coloured "
      "picture as `example`",
      scene,
      kind::kPersonalize,
      kind::kColorizeScene);
}

ColorizerRecord FindColorizer(const ProjectStore& store, const v1::ColorizeImagesRequest& request) {
  if (request.colorizer().empty()) return NewestOf(store, request.scene());
  CheckName(request.colorizer(), "colorizers");
  ColorizerRecord record =
      store.GetColorizer(request.colorizer().substr(request.colorizer().find('/') + 1));
  if (!request.scene().empty() && request.scene() != record.scene) {
    throw ServiceError(ErrorReason::kOtherScene,
                       "{} was made for {}, not for {}; leave out one of the two",
                       request.colorizer(),
                       record.scene,
                       CleanUtf8(request.scene(), 200));
  }
  return record;
}

// Encoder that the colorizer was trained with. Its file may have changed since: the worker compares
// digests.
std::string TrainedEncoder(const ProjectStore& store, const ColorizerRecord& record) {
  return ParseSpec(store.GetJob(record.job).spec, record.job).personalize().encoder();
}

}  // namespace

void ResolveColorizeRequest(const RpcParts& parts,
                            const ProjectStore& store,
                            v1::ColorizeImagesRequest* request,
                            internal::v1::ColorizeImageRequest* call,
                            v1::ColorizeImagesResponse* response) {
  if (request->request_id().size() > kMaxRequestIdBytes) {
    throw InvalidArgument("request_id has {} bytes; at most 128 are allowed",
                          request->request_id().size());
  }
  response->set_request_id(request->request_id());
  const bool trained = !request->colorizer().empty() || !request->scene().empty();
  const bool automatic = request->colorizer() == kAutomaticColorizer;
  const bool has_points = !request->points().empty();
  const int sources = int{trained} + int{request->has_example()};
  if (sources > 1 || (sources == 0 && !has_points) || (has_points && trained && !automatic)) {
    throw InvalidArgument(
        "set one of colorizer, scene, example and points, or points besides an example or {}",
        kAutomaticColorizer);
  }
  TakePicture(parts, store, request, call);
  if (has_points || automatic) {
    call->set_automatic(automatic);
    response->set_colorizer(request->colorizer());
    return TakeStrokes(parts, store, request, call);
  }
  if (request->has_example()) {
    call->set_example_sha256(RequireBlob(parts, store, request->example(), "example"));
    return;
  }
  const ColorizerRecord record = FindColorizer(store, *request);
  response->set_colorizer("colorizers/" + record.digest.sha256);
  response->set_scene(record.scene);
  call->set_colorizer_sha256(record.digest.sha256);
  call->set_encoder(TrainedEncoder(store, record));
}

}  // namespace color3d
