#include "core/scene/sfm_photos.h"

#include <algorithm>
#include <cstdio>

#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

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
    // A flat picture stays flat: noise is not stretched more than 16-fold.
    const float scale = 1.0f / std::max(high - low, 1.0f / 16.0f);
    for (float& v : gray.data) v = (v - low) * scale;
  }
  return gray;
}

std::vector<std::string> WriteFeatureImages(const std::vector<Photo>& photos,
                                            const fs::path& scene_folder,
                                            const fs::path& folder,
                                            int max_side_px,
                                            ProgressObserver& progress,
                                            const CancellationToken& cancel) {
  std::vector<std::string> names;
  for (size_t i = 0; i < photos.size(); ++i) {
    cancel.ThrowIfCancelled();
    progress.OnProgress(
        static_cast<int64_t>(i),
        static_cast<int64_t>(photos.size()),
        "reading photos " + std::to_string(i + 1) + "/" + std::to_string(photos.size()));
    const Image image = FeatureImage(ReadImage(scene_folder / photos[i].file), max_side_px);
    char number[32];
    std::snprintf(number, sizeof(number), "%06zu.png", i + 1);
    const std::string size = std::to_string(image.width) + "x" + std::to_string(image.height);
    names.push_back(size + "/" + number);
    fs::create_directories(folder / size);
    WriteFileAtomic(folder / names.back(), EncodePng8(image));
  }
  return names;
}

}  // namespace color3d
