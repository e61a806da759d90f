#include "core/keyview/frame_content.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/error.h"
#include "core/base/median.h"

namespace color3d {
namespace {

constexpr int kBlockPx = 8;
// Deviation of a block, above that of sensor noise and JPEG ringing in black or white areas.
constexpr double kFlatDeviation = 0.8;
// Deviation of a blank frame.
constexpr double kBlankDeviation = 1.5;
// Shares of the scene's median. A sharp view of a plain corner keeps half; a blur of 1 % of the
// picture's width leaves a quarter of the detail; a frame half covered has half of the structure.
constexpr double kMinDetail = 0.33;
constexpr double kMinStructure = 0.66;
// Photographs reduced to a few hundred px have at least 0.8.
constexpr double kNoiseCorrelation = 0.4;

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

Moments ComputeMoments(const Image& image, int x0, int y0, int width, int height) {
  double sum = 0.0;
  double squares = 0.0;
  for (int y = y0; y < y0 + height; ++y) {
    for (int x = x0; x < x0 + width; ++x) {
      const double value = image.At(0, y, x);
      sum += value;
      squares += value * value;
    }
  }
  const double count = static_cast<double>(width) * height;
  const double mean = sum / count;
  return {mean, std::max(0.0, squares / count - mean * mean)};
}

double StructuredShare(const Image& image) {
  int blocks = 0;
  int structured = 0;
  for (int y = 0; y + kBlockPx <= image.height; y += kBlockPx) {
    for (int x = 0; x + kBlockPx <= image.width; x += kBlockPx) {
      ++blocks;
      const double variance = ComputeMoments(image, x, y, kBlockPx, kBlockPx).variance;
      if (variance > kFlatDeviation * kFlatDeviation) ++structured;
    }
  }
  return blocks > 0 ? static_cast<double>(structured) / blocks : 1.0;
}

double MeanLaplacian(const Image& image) {
  if (image.width < 3 || image.height < 3) return 0.0;
  double sum = 0.0;
  for (int y = 1; y + 1 < image.height; ++y) {
    for (int x = 1; x + 1 < image.width; ++x) {
      sum += std::abs(4.0 * image.At(0, y, x) - image.At(0, y, x - 1) - image.At(0, y, x + 1) -
                      image.At(0, y - 1, x) - image.At(0, y + 1, x));
    }
  }
  return sum / ((image.width - 2.0) * (image.height - 2.0));
}

// 1 - E[(difference of neighbours)^2] / (2 variance).
double NeighborCorrelation(const Image& image, double variance) {
  double sum = 0.0;
  double count = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 1; x < image.width; ++x) {
      const double difference = image.At(0, y, x) - image.At(0, y, x - 1);
      sum += difference * difference;
      count += 1.0;
    }
  }
  return variance > 0.0 && count > 0.0 ? 1.0 - sum / count / (2.0 * variance) : 1.0;
}

template <typename Field>
double MedianField(const std::vector<FrameContent>& frames, Field field) {
  std::vector<double> values;
  for (const FrameContent& frame : frames) values.push_back(frame.*field);
  return Median(std::move(values));
}

// Medians over frames.
struct MedianContent {
  double detail = 0.0;
  double structure = 0.0;
};
MedianContent Medians(const std::vector<FrameContent>& frames) {
  return {MedianField(frames, &FrameContent::detail),
          MedianField(frames, &FrameContent::structure)};
}

}  // namespace

FrameContent MeasureFrameContent(const Image& luminance) {
  if (luminance.Empty() || luminance.channels != 1) {
    throw InvalidArgument("a frame must have 1 channel, but has {}", luminance.channels);
  }
  Image finite = luminance;
  for (float& value : finite.data) value = std::isfinite(value) ? value : 0.0f;
  const Moments whole = ComputeMoments(finite, 0, 0, finite.width, finite.height);
  return {std::sqrt(whole.variance),
          MeanLaplacian(finite),
          StructuredShare(finite),
          NeighborCorrelation(finite, whole.variance)};
}

std::vector<std::string> UnfitFrames(const std::vector<FrameContent>& frames,
                                     const std::vector<int>& groups) {
  std::vector<std::string> reasons(frames.size());
  if (frames.empty()) return reasons;
  std::map<int, std::vector<FrameContent>> of_group;
  const auto group_of = [&](size_t i) { return groups.empty() ? 0 : groups[i]; };
  for (size_t i = 0; i < frames.size(); ++i) of_group[group_of(i)].push_back(frames[i]);
  std::map<int, MedianContent> usual;
  const MedianContent all = Medians(frames);
  for (const auto& [group, members] : of_group) {
    MedianContent& own = usual[group] = Medians(members);
    own.structure = std::max(own.structure, 0.5 * all.structure);
    own.detail = std::max(own.detail, 0.5 * all.detail);
  }
  const double correlation = MedianField(frames, &FrameContent::correlation);
  size_t unfit = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    const FrameContent& frame = frames[i];
    const MedianContent& own = usual.at(group_of(i));
    if (frame.deviation < kBlankDeviation) {
      reasons[i] = "blank";
    } else if (frame.correlation < kNoiseCorrelation && correlation > 1.5 * kNoiseCorrelation) {
      reasons[i] = "noise";
    } else if (frame.structure < kMinStructure * own.structure) {
      reasons[i] = "much of it is empty";
    } else if (frame.detail < kMinDetail * own.detail) {
      reasons[i] = "blurred";
    }
    if (!reasons[i].empty()) ++unfit;
  }
  if (unfit == frames.size()) reasons.assign(frames.size(), "");
  return reasons;
}

}  // namespace color3d
