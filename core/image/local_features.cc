#include "core/image/local_features.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>

#include "core/base/error.h"

namespace color3d {
namespace {

cv::Mat Bytes(const Image& gray) {
  cv::Mat bytes(gray.height, gray.width, CV_8UC1);
  for (int y = 0; y < gray.height; ++y) {
    uint8_t* row = bytes.ptr<uint8_t>(y);
    for (int x = 0; x < gray.width; ++x) {
      row[x] = static_cast<uint8_t>(std::clamp(gray.At(0, y, x), 0.0f, 1.0f) * 255.0f + 0.5f);
    }
  }
  return bytes;
}

}  // namespace

LocalFeatures DetectLocalFeatures(const Image& gray, int max_count, double least_contrast) {
  if (gray.Empty()) throw InvalidArgument("a picture without pixels has no features");
  if (max_count < 1) {
    throw InvalidArgument("{} features asked for; ask for at least 1", max_count);
  }
  constexpr int kDimensions = LocalFeatures::kDimensions;
  LocalFeatures features;
  constexpr int kSmallestPx = 16;  // a descriptor's window; OpenCV's octaves need some pixels, too
  if (std::min(gray.width, gray.height) < kSmallestPx) return features;
  try {
    const auto sift = cv::SIFT::create(/*nfeatures=*/0, /*nOctaveLayers=*/3, least_contrast);
    const cv::Mat picture = Bytes(gray);
    std::vector<cv::KeyPoint> points;
    sift->detect(picture, points);
    // A strict order, so that the choice among equal ones does not depend on the sort.
    std::sort(points.begin(), points.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
      if (a.response != b.response) return a.response > b.response;
      if (a.pt.y != b.pt.y) return a.pt.y < b.pt.y;
      if (a.pt.x != b.pt.x) return a.pt.x < b.pt.x;
      return a.angle < b.angle;
    });
    if (points.size() > static_cast<size_t>(max_count)) points.resize(max_count);
    cv::Mat descriptors;
    sift->compute(picture, points, descriptors);
    features.descriptors.reserve(static_cast<size_t>(descriptors.rows) * kDimensions);
    features.side_px = std::max(gray.width, gray.height);
    for (const cv::KeyPoint& point : points) {
      features.positions.push_back(point.pt.x - 0.5f * static_cast<float>(gray.width - 1));
      features.positions.push_back(point.pt.y - 0.5f * static_cast<float>(gray.height - 1));
    }
    for (int i = 0; i < descriptors.rows; ++i) {
      const float* row = descriptors.ptr<float>(i);
      float sum = 1e-9f;
      for (int d = 0; d < kDimensions; ++d) sum += row[d];
      for (int d = 0; d < kDimensions; ++d) {
        features.descriptors.push_back(std::sqrt(row[d] / sum));
      }
    }
  } catch (const cv::Exception& e) {
    throw Error(ErrorCode::kInternal, "finding features failed: {}", e.err);
  }
  return features;
}

}  // namespace color3d
