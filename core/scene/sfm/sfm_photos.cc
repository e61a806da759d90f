#include "core/scene/sfm/sfm_photos.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"
#include "core/scene/photo_masks.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Small enough to be cheap, large enough that photos of the same objects share features.
constexpr int kSimilaritySidePx = 384;
constexpr int kMaxPhotosInMemory = 4;

// Range between the 0.5 % and the 99.5 % quantile, from a histogram of 4096 steps.
std::pair<float, float> UsedRange(const Image& image) {
  constexpr int kBins = 4096;
  std::vector<size_t> histogram(kBins, 0);
  for (float v : image.data) ++histogram[std::clamp(static_cast<int>(v * kBins), 0, kBins - 1)];
  const size_t tail = image.data.size() / 200;
  int low = 0;
  int high = kBins - 1;
  for (size_t sum = histogram[low]; sum <= tail && low < high; sum += histogram[++low]) {
  }
  for (size_t sum = histogram[high]; sum <= tail && high > low; sum += histogram[--high]) {
  }
  return {static_cast<float>(low) / kBins, static_cast<float>(high + 1) / kBins};
}

// Equal for photos of one camera and zoom.
std::string GroupFolder(const FeatureImages::Group& group) {
  std::string name = fmt::format("{}x{}", group.width, group.height);
  if (group.focal_px > 0.0) name += fmt::format("_f{}", std::lround(group.focal_px));
  if (group.camera > 0) name += fmt::format("_c{}", group.camera);
  return name;
}

// Drops features where `mask`, of any size, is 0.
LocalFeatures Unmasked(const LocalFeatures& features, const Image& mask) {
  LocalFeatures kept;
  kept.side_px = features.side_px;
  const double scale =
      static_cast<double>(std::max(mask.width, mask.height)) / std::max(1, features.side_px);
  for (int i = 0; i < features.count(); ++i) {
    const float* at = &features.positions[2 * i];
    const int x = static_cast<int>(0.5 * mask.width + scale * at[0]);
    const int y = static_cast<int>(0.5 * mask.height + scale * at[1]);
    if (mask.At(0, std::clamp(y, 0, mask.height - 1), std::clamp(x, 0, mask.width - 1)) == 0.0f) {
      continue;
    }
    kept.positions.insert(kept.positions.end(), at, at + 2);
    const auto from = features.descriptors.begin() + int64_t{i} * LocalFeatures::kDimensions;
    kept.descriptors.insert(kept.descriptors.end(), from, from + LocalFeatures::kDimensions);
  }
  return kept;
}

}  // namespace

Image FeatureImage(const Image& photo, int max_side_px) {
  const Image small = FitWithin(photo, max_side_px);
  Image gray(small.width, small.height, 1);
  const size_t n = small.PlaneSize();
  if (small.channels >= 3) {
    const float* r = small.Plane(0);
    const float* g = small.Plane(1);
    const float* b = small.Plane(2);
    for (size_t i = 0; i < n; ++i) gray.data[i] = 0.299f * r[i] + 0.587f * g[i] + 0.114f * b[i];
  } else {
    std::copy_n(small.data.begin(), n, gray.data.begin());
  }
  const auto [low, high] = UsedRange(gray);
  if (high - low < 0.5f) {
    // Flat pictures stay flat: noise is amplified at most 16-fold.
    const float scale = 1.0f / std::max(high - low, 1.0f / 16.0f);
    for (float& v : gray.data) v = (v - low) * scale;
  }
  return gray;
}

FeatureImages WriteFeatureImages(const std::vector<Photo>& photos,
                                 const fs::path& scene_folder,
                                 const fs::path& folder,
                                 const fs::path& mask_folder,
                                 int max_side_px,
                                 int local_features,
                                 const RunControl& run) {
  FeatureImages written;
  const int64_t count = static_cast<int64_t>(photos.size());
  written.names.resize(photos.size());
  if (local_features > 0) written.features.resize(photos.size());
  std::vector<std::string> folders(photos.size());
  std::vector<FeatureImages::Group> seen(photos.size());
  const auto write = [&](int64_t i) {
    run.cancel.ThrowIfCancelled();
    const Photo& photo = photos[i];
    const Image image =
        FeatureImage(ReadImageFitted(scene_folder / photo.file, max_side_px), max_side_px);
    const double focal_px = photo.focal_px * image.width / photo.width;
    seen[i] = {image.width, image.height, focal_px, photo.camera, {}};
    folders[i] = GroupFolder(seen[i]);
    written.names[i] = fmt::format("{}/{:06}.png", folders[i], i + 1);
    fs::create_directories(folder / folders[i]);
    WriteFileAtomic(folder / written.names[i], EncodePng8(image));
    Image mask;
    if (!photo.mask_file.empty()) {
      mask = ReadMask(scene_folder, photo.mask_file, photo.file, photo.width, photo.height);
      fs::create_directories(mask_folder / folders[i]);
      WriteFileAtomic(mask_folder / (written.names[i] + ".png"),
                      EncodePng8(ResizeMask(mask, image.width, image.height)));
    }
    if (local_features > 0) {
      written.features[i] =
          DetectLocalFeatures(FitWithin(image, kSimilaritySidePx), local_features);
      if (!mask.Empty()) written.features[i] = Unmasked(written.features[i], mask);
    }
  };
  // Observers are called from one thread. The number of photos in memory is limited.
  const int64_t batch = std::min(run.pool.thread_count(), kMaxPhotosInMemory);
  for (int64_t begin = 0; begin < count; begin += batch) {
    run.progress.OnProgress(begin, count, fmt::format("reading photos {}/{}", begin + 1, count));
    run.pool.ForEach(std::min(batch, count - begin), [&](int64_t i, int) { write(begin + i); });
  }
  written.masked =
      std::ranges::any_of(photos, [](const Photo& photo) { return !photo.mask_file.empty(); });
  std::map<std::string, size_t> group_of_folder;
  for (size_t i = 0; i < photos.size(); ++i) {
    const auto [it, is_new] = group_of_folder.emplace(folders[i], written.groups.size());
    if (is_new) written.groups.push_back(seen[i]);
    written.groups[it->second].names.push_back(written.names[i]);
  }
  return written;
}

}  // namespace color3d
