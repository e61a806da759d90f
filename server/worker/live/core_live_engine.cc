// Live colorization of pictures with the method library.
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/colorizer/personal/scene_colorizers.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/encoder/encoder.h"
#include "core/image/codec.h"
#include "core/keycolor/picture_checks.h"
#include "server/base/service_error.h"
#include "server/worker/live/live_engine.h"
#include "server/worker/live/loaded_colorizer.h"
#include "server/worker/live/stroke_preview.h"

namespace color3d {
namespace {

// Colouring takes about 60 bytes per pixel.
constexpr ImageLimits kLimits{.max_pixels = 25'000'000, .max_side_px = 30'000};
// Decoded pictures of a batch.
constexpr int64_t kMaxGroupPixels = 16'000'000;
// Working size of examples, for answers in seconds: at 400 px, the training size of colorizers, a
// picture takes half as long again.
constexpr int kExampleSidePx = 320;
// The server allows larger messages, but gRPC clients accept 4 MiB by default.
constexpr size_t kMaxMessageImageBytes = 3 << 20;
constexpr int64_t kMaxFileBytes = int64_t{256} << 20;

class CoreLiveEngine : public LiveEngine {
 public:
  explicit CoreLiveEngine(const LiveEngineSetup& setup)
      : setup_(setup), cache_(setup.cache_bytes), strokes_(setup.threads, setup.picture_bytes) {}

  void WarmUp() override { embedded_ = Encoder::Embedded(); }
  void Colorize(std::vector<LiveTask>& tasks) override;

 private:
  using Request = internal::v1::ColorizeImageRequest;
  struct Picture {
    std::string key;  // key of the colorizer in the cache
    std::shared_ptr<const LoadedColorizer> loaded;
    Image luminance;
    LiveTask* task = nullptr;
  };
  Picture Prepare(const Request& request);
  // Colours pictures of any scenes; pictures of equal size share a pass of the encoder.
  static std::vector<Image> ColorizeBatch(const std::vector<Picture>& group);
  // Colours and answers the group, then empties it.
  void Finish(std::vector<Picture>& group);
  void Answer(std::string png, internal::v1::ColorizeImageResponse* answer);
  Image ReadLuminance(const Request& request);
  std::string KeyOf(const Request& request);
  std::shared_ptr<const Encoder> FindEncoder(const std::string& name);
  LoadedColorizer Load(const Request& request);
  LoadedColorizer FromExample(const Request& request);
  std::string ReadBlob(const std::string& sha256) {
    std::string bytes;
    setup_.blobs.Borrow(
        sha256, [&](const std::filesystem::path& file) { bytes = ReadFile(file, kMaxFileBytes); });
    return bytes;
  }

  const LiveEngineSetup setup_;
  ColorizerCache cache_;
  StrokePreview strokes_;
  FileDigests digests_;
  std::shared_ptr<const Encoder> embedded_;
  // Encoders of users by digest of the file, kept while a cached colorizer refers to them.
  std::map<std::string, std::weak_ptr<const Encoder>> encoders_;
};

std::shared_ptr<const Encoder> CoreLiveEngine::FindEncoder(const std::string& name) {
  if (name.empty()) {
    if (!embedded_) embedded_ = Encoder::Embedded();
    return embedded_;
  }
  const auto file = setup_.models.files.find(name);
  if (file == setup_.models.files.end()) {
    throw ServiceError(ErrorCode::kFailedPrecondition,
                       ErrorReason::kUnknownModel,
                       "the colorizer was trained with the encoder '{}', which this server does "
                       "not have; it has: {}; start it with --model {}=FILE",
                       name,
                       NamesOf(setup_.models.files),
                       name);
  }
  std::weak_ptr<const Encoder>& known = encoders_[digests_.Of(file->second).sha256];
  std::shared_ptr<const Encoder> encoder = known.lock();
  if (!encoder) known = encoder = Encoder::FromWeightFile(file->second);
  return encoder;
}

LoadedColorizer CoreLiveEngine::Load(const Request& request) {
  const std::string bytes = ReadBlob(request.colorizer_sha256());
  LoadedColorizer loaded;
  loaded.encoder = FindEncoder(request.encoder());
  loaded.colorizer = LoadColorizer(bytes, loaded.encoder, setup_.threads);
  loaded.bytes = 2 * static_cast<int64_t>(bytes.size());  // files contain half-precision values
  return loaded;
}

// Colorizer of one coloured picture: its feature bank, with an untrained decoder of weight 0.
LoadedColorizer CoreLiveEngine::FromExample(const Request& request) {
  const std::string bytes = ReadBlob(request.example_sha256());
  ProbeImage(bytes, "the example", kLimits);
  const Image srgb = DecodeImage(bytes, "the example");
  const Image lab = LabFromSrgb(FitWithin(srgb, kExampleSidePx));
  if (srgb.channels != 3 || MeasureChroma(lab).IsGray()) {
    throw ServiceError(ErrorReason::kNoColor,
                       "the example has no colour; send the coloured key view");
  }
  ColorizerOptions options;
  options.iterations = 0;
  options.max_side_px = kExampleSidePx;
  LoadedColorizer loaded;
  loaded.encoder = FindEncoder(request.encoder());
  ThreadPool pool(setup_.threads);
  NoCheckpoints checkpoints;
  NullObserver progress;
  loaded.colorizer = TrainColorizer(loaded.encoder,
                                    {{"the example", LuminanceOfLab(lab), ChromaOfLab(lab)}},
                                    options,
                                    {pool, checkpoints, progress, CancellationToken()});
  loaded.bytes = int64_t{8} << 20;  // bank and decoder
  return loaded;
}

std::string CoreLiveEngine::KeyOf(const Request& request) {
  if (!request.example_sha256().empty()) return "example " + request.example_sha256();
  // The weights of a name may be replaced.
  const auto file = setup_.models.files.find(request.encoder());
  return request.colorizer_sha256() + " " +
         (file == setup_.models.files.end() ? request.encoder() : digests_.Of(file->second).sha256);
}

Image CoreLiveEngine::ReadLuminance(const Request& request) {
  const std::string blob = request.image_sha256().empty() ? "" : ReadBlob(request.image_sha256());
  const std::string& bytes = request.image_sha256().empty() ? request.image() : blob;
  ProbeImage(bytes, "the picture", kLimits);
  return LuminanceFromSrgb(DecodeImage(bytes, "the picture"));
}

CoreLiveEngine::Picture CoreLiveEngine::Prepare(const Request& request) {
  Picture picture;
  picture.key = KeyOf(request);
  picture.loaded = cache_.Get(picture.key, [&] {
    return request.example_sha256().empty() ? Load(request) : FromExample(request);
  });
  picture.luminance = ReadLuminance(request);
  if (request.max_side_px() > 0) {
    picture.luminance = FitWithin(picture.luminance, request.max_side_px());
  }
  return picture;
}

void CoreLiveEngine::Answer(std::string png, internal::v1::ColorizeImageResponse* answer) {
  if (png.size() <= kMaxMessageImageBytes) {
    answer->mutable_image()->swap(png);
    return;
  }
  const FileDigest blob = setup_.blobs.PutBytes(png);
  answer->set_image_sha256(blob.sha256);
  answer->set_image_size_bytes(blob.size_bytes);
}

std::vector<Image> CoreLiveEngine::ColorizeBatch(const std::vector<Picture>& group) {
  std::vector<RoutedPicture> routed;
  std::map<std::string, std::shared_ptr<const Colorizer>> colorizers;
  for (const Picture& picture : group) {
    colorizers[picture.key] = picture.loaded->colorizer;
    routed.push_back({picture.key, &picture.luminance});
  }
  return ColorizeRouted(routed, [&](const std::string& key) { return colorizers.at(key); });
}

void CoreLiveEngine::Finish(std::vector<Picture>& group) {
  std::vector<Image> ab(group.size());
  try {
    ab = ColorizeBatch(group);
  } catch (const std::exception&) {
    // One picture causes the error: each is tried alone below.
  }
  for (size_t i = 0; i < group.size(); ++i) {
    Picture& picture = group[i];
    try {
      if (ab[i].Empty()) ab[i] = picture.loaded->colorizer->Colorize(picture.luminance);
      Answer(EncodePng8(SrgbFromLab(JoinLab(picture.luminance, ab[i]))), picture.task->response);
      picture.task->response->set_encoder_digest(picture.loaded->encoder->digest());
    } catch (const std::exception&) {
      picture.task->error = std::current_exception();
    }
  }
  group.clear();
}

void CoreLiveEngine::Colorize(std::vector<LiveTask>& tasks) {
  std::vector<Picture> group;
  int64_t pixels = 0;
  for (LiveTask& task : tasks) {
    try {
      if (StrokePreview::Takes(*task.request)) {
        const auto read = [this](const std::string& sha256) { return ReadBlob(sha256); };
        Answer(strokes_.Colorize(*task.request, read), task.response);
        continue;
      }
      Picture picture = Prepare(*task.request);
      picture.task = &task;
      pixels += static_cast<int64_t>(picture.luminance.PlaneSize());
      group.push_back(std::move(picture));
    } catch (const std::exception&) {
      task.error = std::current_exception();
    }
    if (pixels < kMaxGroupPixels) continue;
    Finish(group);
    pixels = 0;
  }
  Finish(group);
}

}  // namespace

std::unique_ptr<LiveEngine> MakeLiveEngine(const LiveEngineSetup& setup) {
  return std::make_unique<CoreLiveEngine>(setup);
}

}  // namespace color3d
