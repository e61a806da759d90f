#include "core/keycolor/words/dense_similarity.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/image/crop.h"

namespace color3d {
namespace {

// The picture is monochrome; sentences that mention this fit it better.
constexpr const char* kSentences[] = {"a black and white photo of ", "a photo of ", ""};
constexpr int kMaxWindowsPerSide = 16;  // bounds the work for elongated pictures
constexpr float kMinWeight =
    0.05f;  // weight at a window's border, above 0 so that borders of the picture count

void Normalize(std::vector<float>& vector) {
  double sum = 1e-30;
  for (const float value : vector) sum += static_cast<double>(value) * value;
  for (float& value : vector) value = static_cast<float>(value / std::sqrt(sum));
}

struct Window {
  int left, top, width, height;
};

// Starts of windows of `side` (<= length) over `length`, half overlapping, the last one flush with
// the end.
std::vector<int> Starts(int length, int side) {
  const int count = 1 + static_cast<int>(std::ceil(2.0 * (length - side) / side));
  std::vector<int> starts;
  for (int i = 0; i < count; ++i) {
    starts.push_back(count == 1 ? 0
                                : static_cast<int>(std::lround(static_cast<double>(i) *
                                                               (length - side) / (count - 1))));
  }
  return starts;
}

std::vector<Window> CoverWithWindows(const Image& picture,
                                     const std::vector<int>& windows_per_side) {
  std::vector<Window> windows;
  const int shorter = std::min(picture.width, picture.height);
  const int longer = std::max(picture.width, picture.height);
  for (const int count : windows_per_side) {
    const int side = std::max({1, shorter / count, longer / kMaxWindowsPerSide});
    const int width = std::min(side, picture.width);
    const int height = std::min(side, picture.height);
    for (const int top : Starts(picture.height, height)) {
      for (const int left : Starts(picture.width, width)) {
        windows.push_back({left, top, width, height});
      }
    }
  }
  return windows;
}

// Cosines of a window's grid of features with every text.
Image Cosines(const Image& features, const std::vector<std::vector<float>>& texts) {
  Image cosines(features.width, features.height, static_cast<int>(texts.size()));
  for (const std::vector<float>& text : texts) {
    if (static_cast<int>(text.size()) != features.channels) {
      throw Error(ErrorCode::kInternal,
                  "the dense features have {} channels, the texts {}",
                  features.channels,
                  text.size());
    }
  }
  for (size_t i = 0; i < features.PlaneSize(); ++i) {
    double norm = 1e-30;
    for (int c = 0; c < features.channels; ++c) {
      norm += static_cast<double>(features.Plane(c)[i]) * features.Plane(c)[i];
    }
    for (size_t t = 0; t < texts.size(); ++t) {
      double dot = 0.0;
      for (int c = 0; c < features.channels; ++c) {
        dot += static_cast<double>(features.Plane(c)[i]) * texts[t][c];
      }
      cosines.Plane(static_cast<int>(t))[i] = static_cast<float>(dot / std::sqrt(norm));
    }
  }
  return cosines;
}

// Adds a window's cosines to the map. Weights fall towards its border, where less context is
// visible.
void Blend(const Image& cosines, const Window& window, double scale, Image& sum, Image& weights) {
  const int left = static_cast<int>(std::floor(window.left * scale));
  const int top = static_cast<int>(std::floor(window.top * scale));
  const int width = std::max(1, static_cast<int>(std::ceil(window.width * scale)));
  const int height = std::max(1, static_cast<int>(std::ceil(window.height * scale)));
  const Image fine = Resize(cosines, width, height);
  for (int y = 0; y < height && top + y < sum.height; ++y) {
    for (int x = 0; x < width && left + x < sum.width; ++x) {
      const float border_x = static_cast<float>(std::min(x + 1, width - x)) / width;
      const float border_y = static_cast<float>(std::min(y + 1, height - y)) / height;
      const float weight = kMinWeight + 4.0f * border_x * border_y;
      for (int c = 0; c < sum.channels; ++c) {
        sum.At(c, top + y, left + x) += weight * fine.At(c, y, x);
      }
      weights.At(0, top + y, left + x) += weight;
    }
  }
}

}  // namespace

std::vector<float> MeanTextFeature(const TextImageModel& model, const std::string& thing) {
  std::vector<float> mean;
  for (const char* sentence : kSentences) {
    std::vector<float> feature = model.TextFeatures(sentence + thing);
    Normalize(feature);
    mean.resize(feature.size(), 0.0f);
    for (size_t i = 0; i < feature.size(); ++i) mean[i] += feature[i];
  }
  Normalize(mean);
  return mean;
}

Image DenseSimilarity(const TextImageModel& model,
                      const Image& srgb,
                      const std::vector<std::vector<float>>& texts,
                      const std::vector<int>& windows_per_side,
                      int map_side_px,
                      ProgressObserver& progress,
                      const CancellationToken& cancel) {
  const double scale =
      std::min(1.0, static_cast<double>(map_side_px) / std::max(srgb.width, srgb.height));
  Image sum(std::max(1, static_cast<int>(std::lround(scale * srgb.width))),
            std::max(1, static_cast<int>(std::lround(scale * srgb.height))),
            static_cast<int>(texts.size()));
  Image weights(sum.width, sum.height, 1, 1e-12f);
  const std::vector<Window> windows = CoverWithWindows(srgb, windows_per_side);
  for (size_t i = 0; i < windows.size(); ++i) {
    cancel.ThrowIfCancelled();
    progress.OnProgress(static_cast<int64_t>(i),
                        static_cast<int64_t>(windows.size()),
                        "locating the phrases of the prompt");
    const Window& window = windows[i];
    const Image part = Crop(srgb, window.left, window.top, window.width, window.height);
    Blend(Cosines(model.PatchFeatures(part), texts), window, scale, sum, weights);
  }
  for (int c = 0; c < sum.channels; ++c) {
    for (size_t i = 0; i < sum.PlaneSize(); ++i) sum.Plane(c)[i] /= weights.data[i];
  }
  return sum;
}

}  // namespace color3d
