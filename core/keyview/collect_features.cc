#include "core/keyview/collect_features.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/digest.h"
#include "core/base/file_cache.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"
#include "core/keyview/coverage.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr int kFeatureSidePx = 384;
constexpr int kThumbnailQuality = 85;
constexpr int64_t kCacheBytes = int64_t{256} << 20;
// Version of the cache. Increase when the features change.
constexpr char kRecipe[] = "view features 1";

std::string Thumbnail(const Image& luminance) {
  Image gray = FitWithin(luminance, kThumbnailSidePx);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return EncodeJpeg(gray, kThumbnailQuality);
}

ViewFeatures Compute(const Encoder& describer,
                     const Encoder& encoder,
                     const fs::path& photo,
                     const std::string& sha256) {
  const Image luminance = LuminanceFromSrgb(ReadImageWithin(photo, kFeatureSidePx));
  ViewFeatures features = PackViewFeatures(describer.Describe(luminance),
                                           MeasureFrameContent(luminance),
                                           encoder.DeepFeatures(luminance),
                                           std::stoull(sha256.substr(0, 15), nullptr, 16));
  features.thumbnail = Thumbnail(luminance);
  return features;
}

ViewFeatures Provide(const Encoder& describer,
                     const Encoder& encoder,
                     const fs::path& photo,
                     const FileCache& cache) {
  const std::string sha256 = DigestFile(photo).sha256;
  const std::string key = Sha256Hex(fmt::format(
      "{}\n{}\n{}\n{}\n{}", kRecipe, describer.digest(), encoder.digest(), kFeatureSidePx, sha256));
  if (const auto bytes = cache.Get(key)) {
    if (auto features = ParseViewFeatures(*bytes)) return *std::move(features);
  }
  ViewFeatures features = Compute(describer, encoder, photo, sha256);
  cache.Put(key, SerializeViewFeatures(features));
  return features;
}

}  // namespace

std::vector<ViewFeatures> CollectViewFeatures(const Encoder& describer,
                                              const Encoder& encoder,
                                              const std::vector<fs::path>& photos,
                                              const fs::path& cache_folder,
                                              const RunControl& run) {
  const FileCache cache(cache_folder, kCacheBytes);
  const int64_t count = static_cast<int64_t>(photos.size());
  std::vector<ViewFeatures> features(photos.size());
  // In rounds, so that progress is reported on the calling thread.
  const int64_t round = 4 * run.pool.thread_count();
  for (int64_t begin = 0; begin < count; begin += round) {
    run.cancel.ThrowIfCancelled();
    run.pool.ForEach(std::min(round, count - begin), [&](int64_t k, int) {
      if (run.cancel.IsCancelled()) return;
      SetTorchThreads(1);
      ViewFeatures& view = features[begin + k];
      view = Provide(describer, encoder, photos[begin + k], cache);
      view.KeepCells(CellsForCoverage(photos.size(), view.channels));
    });
    run.cancel.ThrowIfCancelled();
    run.progress.OnProgress(std::min(count, begin + round), count, "features");
  }
  cache.Trim();
  return features;
}

}  // namespace color3d
